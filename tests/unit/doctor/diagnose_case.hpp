#pragma once

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "case.hpp"
#include "panelgate/doctor/doctor.hpp"

namespace panelgate::doctor {

using Stations = std::map<std::uint8_t, arbiter::Symptoms>;
using Causes = std::vector<std::string>;

class Diagnose : public testing::Test {
  protected:
    Diagnose() { facts.serial = {9600, 8, Parity::even, 1}; }

    std::vector<Finding> findings(Stations stations,
                                  const std::vector<Finding>& standing = {}) const {
        Sample window;
        window.stations = std::move(stations);
        window.uart = uart;
        window.broadcasts = broadcasts;
        return diagnose(facts, window, standing);
    }
    /// "wrong-baud", or with its station "gap-too-short 2".
    Causes causes(Stations stations, const std::vector<Finding>& standing = {}) const {
        Causes list;
        for (const Finding& f : findings(std::move(stations), standing)) {
            std::string text(code(f.cause));
            if (f.station) text += " " + std::to_string(*f.station);
            list.push_back(std::move(text));
        }
        return list;
    }

    LineFacts facts;
    std::optional<line::UartErrors> uart;
    std::uint64_t broadcasts = 0;
};

}  // namespace panelgate::doctor
