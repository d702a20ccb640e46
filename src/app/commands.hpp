#pragma once

#include <string>
#include <vector>

#include "exit_code.hpp"

namespace panelgate::app {

inline constexpr const char* kDefaultConfig = "/etc/panelgate/panelgate.yaml";

/// One function a command; each returns the exit code and has told the user why on stderr.
ExitCode run(const std::string& file, bool simulate);
/// `http` and `modbus` replace the demo's addresses when not empty: "ADDR:PORT".
ExitCode demo(const std::string& http, const std::string& modbus);
ExitCode check(const std::string& file, bool json);
/// `links`: "NAME=PTY-LINK" a line; no entry = only the pty's own path is printed.
ExitCode simulate(const std::string& file, const std::vector<std::string>& links);
ExitCode address(const std::string& profile, const std::string& what);
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
/// Lists all, or describes one.
ExitCode profiles(const std::string& name);

}  // namespace panelgate::app
