#pragma once

#include <sys/types.h>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/audit/chain.hpp"
#include "panelgate/audit/record.hpp"
#include "panelgate/audit/settings.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::audit {

/// Writes a chain to a file and its successors, synchronously. Nothing that was given to it is
/// dropped when the disk fails: work() goes on where it stopped. One thread.
class Writer {
  public:
    using Wall = std::function<WallTime()>;

    /// Takes each record as it is written, once, without its newline.
    using Also = std::function<void(std::string_view line)>;

    /// `start`: members of the record `start` behind its time, such as `,"version":"1.0.0"`.
    /// `also` may be empty.
    Writer(Settings settings, Wall wall, std::string start, Also also = {});
    ~Writer();
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;

    /// Another file begins with a record `start` of its own; the chain is that file's. What the
    /// file before has not taken is written there.
    void apply(const Settings& settings);
    /// Takes bodies, one a line; only when idle().
    void take(std::string& bodies);
    bool idle() const { return at_ == batch_.size() && out_.size() == sent_; }
    /// Writes and synchronizes what was taken. False: the disk does not take it now; see why().
    bool work();
    const std::string& why() const { return why_; }
    /// The last record that is on the disk.
    const Position& last() const { return safe_; }
    std::uint64_t records() const { return records_; }
    std::uint64_t rotations() const { return rotations_; }
    /// The chain's id, which the log names with its records; empty: its first file has none.
    const std::string& chain_id() const { return id_; }
    /// Records that were taken and are not on the disk, as far as it can tell.
    std::uint64_t unwritten();
    /// What should be said of the file that was found, or has gone; told once.
    std::string remark() { return std::exchange(remark_, {}); }

  private:
    bool ensure_open();
    bool open();
    bool resume();
    bool resume_from(std::string_view end, bool is_whole);
    bool set_aside(const char* why);
    bool look_after_file();
    void read_head(std::string_view head);
    void resume_after_older();
    bool rotate();
    std::vector<std::string> find_oldest();
    void begin_file();
    void begin_run();
    void append(std::string_view body);
    void seal();
    void take_back();
    bool flush();
    bool sync();
    bool fail(const std::string& what);
    void close();

    Settings settings_;
    Wall wall_;
    std::string start_;
    Also also_;
    Composer composer_;
    Chain chain_;
    Position safe_;
    bool known_ = false;  ///< the chain's position is known
    bool begun_ = false;  ///< the record `start` is written
    bool unclean_ = false;
    std::string id_;
    std::uint64_t from_ = 1;  ///< the first record that rotation has not dropped
    std::uint64_t gone_ = 0;  ///< the first record of a file that was removed; 0: none was
    std::uint64_t torn_bytes_ = 0;
    std::string torn_;
    std::string remark_;
    int file_ = -1;
    std::size_t size_ = 0;
    std::uint64_t first_ = 0;  ///< number of the file's first record
    std::string batch_;
    std::size_t at_ = 0;  ///< of batch_, sealed so far
    std::string out_;
    std::size_t sent_ = 0;  ///< of out_, written so far
    bool unsynced_ = false;
    std::string why_;
    std::uint64_t records_ = 0;
    std::uint64_t sealed_ = 0;
    std::uint64_t rotations_ = 0;
};

}  // namespace panelgate::audit
