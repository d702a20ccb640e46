#include "panelgate/web/http/caller.hpp"

#include <utility>

namespace panelgate::web {

Caller::Caller(std::uint64_t id, std::string address) : id_(id), address_(std::move(address)) {}

bool Caller::at_leaving(const void* whom, std::function<void()> farewell) {
    return farewells_.emplace(whom, std::move(farewell)).second;
}

void Caller::leave() {
    if (std::exchange(left_, true)) return;
    for (const auto& [whom, farewell] : std::exchange(farewells_, {})) farewell();
}

}  // namespace panelgate::web
