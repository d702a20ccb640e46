#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/base/reload_outcome.hpp"
#include "panelgate/base/wall_time.hpp"

namespace panelgate::web {

/// What came of a reload, for people and programs.
struct ReloadVerdict {
    /// Where a file is wrong. Line and column from 1; 0: the file as a whole.
    struct Fault {
        std::string file;
        int line = 0;
        int column = 0;
        std::string text;
    };
    ReloadOutcome outcome = ReloadOutcome::unchanged;
    WallTime at{};
    bool rollback = false;             ///< it was to what ran before
    std::string cause;                 ///< who wanted it: "SIGHUP", "http 10.0.0.9"
    std::vector<std::string> changes;  ///< a line each: "lines/floor1/stations/press: added"
    std::vector<std::string> later;    ///< what only a restart changes
    std::vector<std::string> warnings;
    std::vector<Fault> faults;  ///< of outcome invalid
    std::string why;            ///< of outcomes failed and refused
    /// What protects less after a way back: "station press: access read_only -> read_write".
    std::vector<std::string> weaker;
};

struct ReloadWish {
    bool rollback = false;  ///< what ran before, in place of the file
    bool weaker = false;    ///< ... also where that protects less than what runs
    friend bool operator==(const ReloadWish&, const ReloadWish&) = default;
};

/// Reads the configuration again and serves it. One thread.
class ReloadSource {
  public:
    using Handler = std::function<void(std::shared_ptr<const ReloadVerdict>)>;

    virtual ~ReloadSource() = default;
    /// Why there is nothing to be read, or to go back to; empty: there is.
    virtual std::string barred(bool rollback) const = 0;
    /// Not while barred(). The handler is called once, from the loop; who comes while one is under
    /// way gets the next.
    virtual void reload(ReloadWish wish, std::string cause, Handler handler) = 0;
    /// Of the last one; null: there was none.
    virtual std::shared_ptr<const ReloadVerdict> last() const = 0;
};

}  // namespace panelgate::web
