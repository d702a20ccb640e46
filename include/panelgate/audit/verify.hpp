#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/audit/chain.hpp"

namespace panelgate::audit {

/// The first thing that is wrong with a chain.
struct Fault {
    enum class Kind : std::uint8_t { changed, removed, added, reordered, torn, anchor };
    Kind kind = Kind::changed;
    std::uint64_t number = 0;  ///< of the record; of several the first
    std::string file{};
    std::uint64_t line = 0;  ///< from 1; 0: the end of what was read
    std::string text{};      ///< a clause for the user
};
/// Returns "changed", "removed", ...
std::string_view label(Fault::Kind kind);

/// What the log says of audits.
struct Anchors {
    bool is_read = false;  ///< a log was read, whatever it says
    /// Records that it names, by their chain: number and hash, or its beginning.
    std::map<std::string, std::map<std::uint64_t, std::string>, std::less<>> chains{};
    std::map<std::string, std::string, std::less<>> files{};  ///< of chains, where it is said
    std::uint64_t lost = 0;  ///< records that could not be written when a run ended
};
/// Adds what a line of the log says, of format text or json, whatever a collector has put before
/// it. Only the event itself counts: what clients send stands in quotes there. Pure.
void collect_anchor(std::string_view log_line, Anchors& anchors);

struct Report {
    std::uint64_t first = 0;  ///< number of the first record; 0: there was none
    std::uint64_t records = 0;
    std::uint64_t anchored = 0;  ///< anchors that were compared
    std::string chain{};         ///< its id; empty: it has none
    Position last{};
    std::optional<Fault> fault{};
    /// What the records themselves say is missing: runs that did not end in order, torn lines,
    /// records for which there was no room.
    std::vector<std::string> remarks{};
};

/// Reads a chain line by line, over files in order, and finds the first record that was changed,
/// removed, added or put elsewhere. Pure.
class Verifier {
  public:
    static constexpr std::size_t kRemarks = 1000;

    /// `all_of`: these are all files of the audit that is written to this one, so that what is
    /// missing before them was removed; empty: they may be some.
    explicit Verifier(Anchors anchors = {}, std::string all_of = {})
        : anchors_(std::move(anchors)), all_of_(std::move(all_of)) {}

    /// A file begins; lines that follow are its.
    void begin_file(std::string name);
    /// `line` without its newline; `whole`: it had one. False: nothing more needs to be read.
    bool take(std::string_view line, bool whole);
    /// All has been read.
    Report finish();

  private:
    /// A fault that what follows tells apart from others.
    struct Suspect {
        Fault fault;
        std::uint64_t found = 0;     ///< the number that stands where `fault.number` is expected
        Hash claimed{};              ///< the hash of what stands there
        std::uint64_t followed = 0;  ///< records that have been looked at since
        bool next_is_expected = false;
        bool seen_expected = false;
    };

    Fault fault_here(Fault::Kind kind, std::uint64_t number, std::string text) const;
    void decide(Fault::Kind kind, std::string text);
    void suspect(Fault::Kind kind, const Sealed* record);
    void begin_chain(const Sealed& record);
    void judge(const Sealed& record);
    void accept(const Sealed& record);
    void look_on(const Sealed& record);
    void look_on_after_change(const Sealed& record);
    void look_on_after_jump(const Sealed& record);
    void decide_at_end();
    void look_at_file(const Sealed& record);
    void compare(const Sealed& record);
    void note(std::string text);
    void remark(const Sealed& record);
    void check_begin();
    void check_end();
    void check_anchors();
    void tell_of_log();
    void check_other_chain(const std::string& chain, std::uint64_t last);

    Anchors anchors_;
    std::string all_of_;
    bool has_chain_ = false;       ///< report_.chain is known
    std::uint64_t kept_from_ = 0;  ///< the first record that was not dropped by rotation
    Sha256 digest_;
    Report report_;
    std::optional<Suspect> suspect_;
    std::string file_;
    std::uint64_t line_ = 0;
    bool decided_ = false;
};

/// Returns these files in the order of their first records. `head_of` returns a file's first line.
std::vector<std::string> in_order(std::vector<std::string> files,
                                  const std::function<std::string(const std::string&)>& head_of);

}  // namespace panelgate::audit
