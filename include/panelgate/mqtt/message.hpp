#pragma once

#include <string>

namespace panelgate::mqtt {

/// What one PUBLISH carries.
struct Message {
    std::string topic;
    std::string payload;
    int qos = 1;
    bool retain = false;

    friend bool operator==(const Message&, const Message&) = default;
};

}  // namespace panelgate::mqtt
