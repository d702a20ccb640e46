#pragma once

#include <string>
#include <string_view>

#include "panelgate/audit/record.hpp"
#include "panelgate/gateway/plant.hpp"

namespace panelgate::gateway {

/// What a request of REST was about, as far as its path and body tell.
struct AskedPlace {
    std::string line{};
    const Station* station = nullptr;  ///< null: none, or not one of the plant's
    std::string at{};                  ///< in the panel's notation; empty: no place of it
};

/// `path`: decoded, "/api/v1/stations/press/points/speed". Pure.
AskedPlace asked_place(const Plant& plant, std::string_view path, std::string_view body);

/// Its members of a record: `"line":"floor1","station":"press","id":7,"at":"UW102"`.
audit::Members members_of(const AskedPlace& place);

}  // namespace panelgate::gateway
