#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/audit/chain.hpp"
#include "panelgate/audit/record.hpp"
#include "panelgate/audit/settings.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::audit {

/// Writes a chain to a file and its successors, synchronously. What the disk does not take stays
/// with the caller. One thread.
class Writer {
  public:
    using Wall = std::function<WallTime()>;

    /// `start`: members of the record `start` behind its time.
    Writer(Settings settings, Wall wall, Members start);
    ~Writer() { close(); }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;

    /// Changes all but the file.
    void apply(const Settings& settings) { settings_ = settings; }
    /// Writes and synchronizes bodies, each with a newline behind it, and clears `bodies`. False:
    /// the disk takes nothing now; see why().
    bool write(std::string& bodies);
    const std::string& why() const { return why_; }
    /// The last record that is on the disk.
    const Position& last() const { return chain_.last(); }
    std::uint64_t records() const { return records_; }
    std::uint64_t rotations() const { return rotations_; }
    /// The chain's id, as in anchors of the log; empty: the chain's first file has no id.
    const std::string& chain_id() const { return id_; }
    /// What should be said of the file that was found, or has gone; told once.
    std::string remark() { return std::exchange(remark_, {}); }

  private:
    bool ensure_open();
    void look_after_file();
    bool open();
    bool resume();
    bool find_position();
    bool set_aside(const char* why);
    void compose_head();
    bool rotate();
    std::vector<std::string> find_oldest();
    bool append(std::string& bodies);
    bool fail(const std::string& what);
    void close();

    Settings settings_;
    Wall wall_;
    Members start_;
    Chain chain_;
    bool known_ = false;  ///< the chain's position is known
    bool begun_ = false;  ///< the record `start` is on the disk
    bool unclean_ = false;
    std::string head_;  ///< bodies that the file begins with, or the run, and that are not written
    std::string id_;
    std::uint64_t from_ = 1;  ///< the first record that rotation has not dropped
    std::uint64_t gone_ = 0;  ///< the first record of a file that was removed; 0: none was
    std::string torn_;
    std::string remark_;
    int file_ = -1;
    std::size_t size_ = 0;
    std::uint64_t first_ = 0;  ///< number of the file's first record; 0: the file is not ours yet
    std::string why_;
    std::uint64_t records_ = 0;
    std::uint64_t rotations_ = 0;
};

}  // namespace panelgate::audit
