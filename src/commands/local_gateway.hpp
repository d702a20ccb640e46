#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "panelgate/config/endpoint.hpp"

namespace panelgate::commands {

/// The inodes of the sockets that listen where `endpoint` is reached, in the text of
/// /proc/net/tcp or tcp6 (proc(5)): at its address, or at all addresses if it is on loopback, as
/// any other address may be another machine's. Pure.
std::set<std::string> listening_inodes(std::string_view table, const config::Endpoint& endpoint);

/// Returns the panelgate process of this machine that listens at `endpoint`; nothing without such a
/// process, or if the user may not see processes. `proc`: the folder of procfs.
std::optional<pid_t> process_at(const config::Endpoint& endpoint,
                                const std::filesystem::path& proc = "/proc");

}  // namespace panelgate::commands
