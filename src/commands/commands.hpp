#pragma once

#include <string>
#include <vector>

#include "panelgate/explain/load.hpp"

namespace panelgate::commands {

using explain::ExitCode;
using enum explain::ExitCode;

inline constexpr const char* kDefaultConfig = "/etc/panelgate/panelgate.yaml";

/// One function per command; each returns the exit code after printing the reason on stderr.
/// `watch`: reload the file when it changes.
ExitCode run(const std::string& file, bool simulate, bool watch);
/// `http` and `modbus` replace the demo's addresses when not empty: "ADDR:PORT".
ExitCode demo(const std::string& http, const std::string& modbus);
/// The command line of `check`.
struct CheckOptions {
    std::string before;  ///< a file to compare with; empty: show the configuration itself
    bool json = false;
    /// Report a planned overload as a warning, not as kBadConfig.
    bool allow_overload = false;
    std::string explain{};  ///< a request in words: print only the rule that decides about the
                            ///< request
};
ExitCode check(const std::string& file, const CheckOptions& options);
/// Prints the setting at a path ("lines.floor1.stations.press.retries"), or all below it; "": all.
/// Defaults are filled in, secrets are not shown.
ExitCode config_get(const std::string& file, const std::string& path);
/// Prints what keys there are at and below a path ("lines.stations.points"), with values, defaults
/// and a sentence each; "": all. `as_json`: {"keys": [...]}, for programs.
ExitCode config_keys(const std::string& path, bool as_json);
/// Prints a JSON Schema of the configuration.
ExitCode schema();
/// The command line of `audit`; texts are empty when not given.
struct AuditOptions {
    std::vector<std::string> files;       ///< none: those of the configuration
    std::string config = kDefaultConfig;  ///< names them
    std::vector<std::string> logs;        ///< of the gateway, for verify; "-" standard input
    std::string station;
    std::string since;
    std::string until;
    std::string kind;
    std::string client;
    bool json = false;
};
/// Says whether an audit is whole, or what is wrong with it first.
ExitCode audit_verify(const AuditOptions& options);
/// Prints records.
ExitCode audit_show(const AuditOptions& options);
/// The command line of `token new`.
struct TokenOptions {
    std::string name;
    std::string role = "operator";
    std::string expires;  ///< "90d", "2027-12-31", or empty
    std::string output;   ///< the file for its hash; empty: it is printed
};
/// Makes a token and prints it once, with what the configuration must say.
ExitCode token_new(const TokenOptions& options);
struct GatewayOptions;
/// Checks whether the gateway is ready.
ExitCode health(const GatewayOptions& options, bool active);
/// What `--ca` is, of all commands that ask a running gateway.
inline constexpr const char* kCa =
    "a file of the CA that has signed its certificate, where the configuration file is not at hand "
    "(with --http https://ADDR:PORT)";
/// Which running gateway is asked.
struct GatewayOptions {
    std::string file = kDefaultConfig;  ///< names its HTTP address
    std::string http{};                 ///< overrides it: "ADDR:PORT"
    std::string token_file{};           ///< its first line is a token
    std::string ca{};                   ///< file of the CA that has signed its certificate
};
/// The command line of `read`; texts are empty and `count` 0 when not given.
struct ReadOptions {
    std::vector<std::string> words;  ///< STATION PLACE, or both as one
    std::string type;
    std::string order;
    unsigned count = 0;
    bool json = false;
};
/// Reads a place through a running gateway.
ExitCode read(const GatewayOptions& at, const ReadOptions& options);
struct WriteOptions {
    std::vector<std::string> words;  ///< STATION PLACE VALUE...
    std::string type;
    std::string order;
};
/// Writes a place through a running gateway.
ExitCode write(const GatewayOptions& at, const WriteOptions& options);
struct WatchOptions {
    std::vector<std::string> words;  ///< stations, each with its places
    std::string type;
    std::string order;
    unsigned count = 0;  ///< lines after which it ends; 0: never
};
/// Prints a line at each change of places.
ExitCode watch(const GatewayOptions& at, const WatchOptions& options);
/// Prints the state of lines and stations.
ExitCode status(const GatewayOptions& at, bool json);
/// Shows load, clients and slow panels; again each second unless `once`.
ExitCode top(const GatewayOptions& at, bool once);
struct TraceOptions {
    std::string station;
    std::string line;
    bool errors = false;  ///< only transactions that failed
    unsigned count = 20;  ///< the last of them
    bool follow = false;
};
/// Prints transactions.
ExitCode trace(const GatewayOptions& at, const TraceOptions& options);
/// Writes a bundle for support; "": a name with the time.
ExitCode report(const GatewayOptions& at, const std::string& file);
/// Prints the names of stations, or of a station's points, for the shell's completion; says nothing
/// if they cannot be had.
ExitCode names(const GatewayOptions& at, const std::string& station);
/// The command line of `reload` as typed.
struct ReloadOptions {
    std::string file;        ///< names the gateway's HTTP address
    std::string http;        ///< overrides it: "ADDR:PORT"
    std::string token_file;  ///< its first line is a token of the role operator
    bool rollback = false;   ///< return to the previous configuration
    bool weaker = false;     ///< ... even if it protects less
    std::string ca{};        ///< file of the CA that has signed its certificate
};
/// Makes a running gateway reload its file, and prints the verdict.
ExitCode reload(const ReloadOptions& options);
/// `links`: "NAME=PTY-LINK" or "NAME=tcp://ADDR:PORT" per line; a line without an entry has only
/// its pty. `http`: "ADDR:PORT" of the REST API for the faults, or empty.
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
    std::string profiles;  ///< a directory of further profiles
    bool yaml = false;
    bool speak = false;  ///< scan even if another master is talking
    bool quick = false;  ///< ask each address once
};
ExitCode scan(const ScanOptions& options);
/// Where to write a configuration.
struct OutputFile {
    std::string file;    ///< empty: standard output
    bool force = false;  ///< overwrite an existing file
};
/// The `yaml` option is ignored.
ExitCode init(const ScanOptions& options, const OutputFile& output);
/// Converts another gateway's configuration; "-" for standard input. Nothing is written of a file
/// that has faults.
ExitCode import_conf(const std::string& file, const OutputFile& output);
/// Lists all profiles, or describes one; `dir` as in address().
ExitCode profiles(const std::string& name, const std::string& dir);
/// Judges a file that describes a panel as loading it does; "-" for standard input.
ExitCode check_profile_file(const std::string& file);

}  // namespace panelgate::commands
