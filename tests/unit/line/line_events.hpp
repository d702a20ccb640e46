#pragma once

#include <string>
#include <vector>

#include "panelgate/line/line.hpp"

namespace panelgate::line {

/// Records the events of a line.
struct Heard final : Line::Events {
    void on_up() override { ++ups; }
    void on_down(const std::string& why) override { downs.push_back(why); }
    void on_bytes(ByteView more) override { bytes.insert(bytes.end(), more.begin(), more.end()); }

    int ups = 0;
    std::vector<std::string> downs;
    Bytes bytes;
};

}  // namespace panelgate::line
