#pragma once

#include <string>
#include <vector>

namespace panelgate::app {

/// Exit codes (README, Configuration), after sysexits(3).
enum ExitCode : int {
    kFine = 0,
    kCut = 1,       ///< told twice to end: what was in flight is not answered
    kNotReady = 1,  ///< health: /readyz is not 200
    kUsage = 64,
    kNoInput = 66,
    kUnavailable = 69,
    kInternal = 70,
    kBadConfig = 78,
};

inline constexpr const char* kDefaultConfig = "/etc/panelgate/panelgate.yaml";

/// One function a command; each returns the exit code and has told the user why on stderr.
/// `watch`: a file that changes is read again.
ExitCode run(const std::string& file, bool simulate, bool watch);
/// `http` and `modbus` replace the demo's addresses when not empty: "ADDR:PORT".
ExitCode demo(const std::string& http, const std::string& modbus);
/// The command line of `check`.
struct CheckOptions {
    std::string before;  ///< a file: say what changes from it; empty: show what there is
    bool json = false;
    /// A line that has more to carry than its time is a warning, not kBadConfig.
    bool allow_overload = false;
};
ExitCode check(const std::string& file, const CheckOptions& options);
/// Prints a JSON Schema of the configuration.
ExitCode schema();
/// Is the gateway ready? `http`: "ADDR:PORT" of its REST, or empty: what `file` says, and the
/// default where there is none that can be read.
ExitCode health(const std::string& file, const std::string& http);
/// The command line of `reload` as typed.
struct ReloadOptions {
    std::string file;        ///< says where the gateway listens
    std::string http;        ///< or this does: "ADDR:PORT"
    std::string token_file;  ///< its first line is a token of the role operator
    bool rollback = false;   ///< to what ran before
    bool weaker = false;     ///< ... also where that protects less
};
/// Has a running gateway read its file again, and prints its verdict.
ExitCode reload(const ReloadOptions& options);
/// `links`: "NAME=PTY-LINK" or "NAME=tcp://ADDR:PORT" a line; no entry: its pty alone. `http`:
/// "ADDR:PORT" of the REST that sets faults, or empty.
ExitCode simulate(const std::string& file, const std::vector<std::string>& links,
                  const std::string& http);
/// `dir`: a directory of further profiles, or empty.
ExitCode address(const std::string& profile, const std::string& what, const std::string& dir);
/// The command line of `scan` as typed; lists are empty when not given.
struct ScanOptions {
    std::string device;
    std::string baud;
    std::string parity;
    std::string stations;
    std::string profiles;  ///< a directory of further ones
    bool yaml = false;
    bool speak = false;  ///< although another master is talking
};
ExitCode scan(const ScanOptions& options);
/// Where a configuration is written.
struct OutputFile {
    std::string file;    ///< empty: standard output
    bool force = false;  ///< over one that is there
};
/// `yaml` of the options is not asked.
ExitCode init(const ScanOptions& options, const OutputFile& output);
/// `file`: another gateway's configuration, "-" for standard input.
ExitCode import_conf(const std::string& file);
/// Lists all, or describes one; `dir` as of address().
ExitCode profiles(const std::string& name, const std::string& dir);

}  // namespace panelgate::app
