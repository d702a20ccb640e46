#pragma once

#include <cstdint>
#include <optional>

#include "loader.hpp"
#include "panelgate/tls/settings.hpp"
#include "setting_writer.hpp"

namespace panelgate::config {

/// Of Modbus/TCP Security, where a listener with `tls` names none.
inline constexpr std::uint16_t kSecurePort = 802;

/// Reads the key `tls` of a listener with its files; nothing without it. Files that cannot serve
/// are problems.
std::optional<tls::Settings> load_tls(Loading& loading, yaml::MapReader& in);

/// Reads the key `tls` of a Modbus listener into its settings, with the port of Modbus/TCP Security
/// where no `listen` is given.
void load_modbus_security(Loading& loading, yaml::MapReader& in, tcp_server::Settings& settings);

/// Shows it below a listener: the keys, and what the files hold as a secret, so that a change of
/// either is a difference.
void show_tls(const SettingWriter& listener, const std::optional<tls::Settings>& settings);

}  // namespace panelgate::config
