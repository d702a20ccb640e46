#include "shared.hpp"

#include <string>

namespace panelgate::tcp_server {

void Shared::log(std::string_view event, std::string_view client, std::string_view more) const {
    if (!hooks.log) return;
    std::string line(event);
    line.append(" listener=").append(counters.listener);
    if (!client.empty()) line.append(" client=").append(client);
    if (!more.empty()) line.append(" ").append(more);
    hooks.log(line);
}

}  // namespace panelgate::tcp_server
