#include "shared.hpp"

#include <utility>

namespace panelgate::tcp_server {

void Shared::log(rt::LogLevel level, std::string_view event, std::vector<rt::LogField> more) const {
    more.insert(more.begin(), rt::LogField{"listener", counters.listener});
    rt::log(level, event, more);
}

}  // namespace panelgate::tcp_server
