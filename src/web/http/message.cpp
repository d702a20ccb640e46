#include "panelgate/web/http/message.hpp"

#include <vector>

#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {

void log_client(const Caller& caller, std::string_view event,
                std::initializer_list<std::pair<std::string_view, std::string>> fields) {
    std::vector<rt::LogField> all{{"client", caller.name()}};
    for (const auto& [key, value] : fields) all.emplace_back(key, excerpt(value));
    rt::log(rt::LogLevel::info, event, all);
}

}  // namespace panelgate::web
