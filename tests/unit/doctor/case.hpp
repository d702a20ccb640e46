#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/doctor/doctor.hpp"

namespace panelgate::doctor {

using Stations = std::map<std::uint8_t, arbiter::Symptoms>;

/// Counts of one station, as the arbiter would count them.
class Mix {
  public:
    Mix& answered(std::uint64_t n, std::size_t pause = arbiter::Symptoms::kPauses - 1) {
        s_.answered += n;
        s_.answered_after[pause] += n;
        s_.mute_in_a_row = 0;
        return *this;
    }
    Mix& long_answered(std::uint64_t n) {
        s_.long_answered += n;
        return answered(n);
    }
    Mix& silent(std::uint64_t n) {
        s_.silent += n;
        s_.mute_in_a_row += n;
        return *this;
    }
    /// n silent attempts whose requests were answered when asked again.
    Mix& lost(std::uint64_t n, std::size_t pause = arbiter::Symptoms::kPauses - 1) {
        silent(n);
        s_.silent_after[pause] += n;
        s_.mute_in_a_row = 0;
        return *this;
    }
    /// One wrong byte in otherwise right replies of 11 bytes.
    Mix& damaged(std::uint64_t n) { return exact(n, 11, 3, 4, n); }
    Mix& long_damaged(std::uint64_t n) {
        s_.long_damaged += n;
        return exact(n, 69, 30, 20, n);
    }
    /// The right length; bytes dropped by the parity check are zero.
    Mix& zeroed(std::uint64_t n) { return exact(n, 11, 7, 4, 0); }
    /// The right length, no byte right, none zero.
    Mix& strange(std::uint64_t n) { return exact(n, 11, 0, 6, 0); }
    /// Any length, any bytes.
    Mix& garbage(std::uint64_t n) {
        s_.damaged_short += n / 2;
        s_.damaged_long += n - n / 2;
        s_.damaged_bytes += 12 * n;
        s_.damaged_zeros += 2 * n;
        s_.damaged_odd += 5 * n;
        s_.mute_in_a_row = 0;
        return *this;
    }
    Mix& with(std::uint64_t arbiter::Symptoms::* count, std::uint64_t n) {
        s_.*count += n;
        return *this;
    }
    Mix& late(std::uint64_t n, Duration by) {
        s_.late += n;
        s_.worst_lateness = by;
        return *this;
    }
    operator arbiter::Symptoms() const { return s_; }  // NOLINT: what it is for

  private:
    Mix& exact(std::uint64_t n, std::uint64_t bytes, std::uint64_t zeros, std::uint64_t odd,
               std::uint64_t heads) {
        s_.damaged_exact += n;
        s_.damaged_bytes += bytes * n;
        s_.damaged_zeros += zeros * n;
        s_.damaged_odd += odd * n;
        s_.damaged_heads += heads;
        s_.mute_in_a_row = 0;
        return *this;
    }

    arbiter::Symptoms s_;
};

class Diagnose : public testing::Test {
  protected:
    Diagnose() { facts.serial = {9600, 8, Parity::even, 1}; }

    std::vector<Finding> findings(Stations stations,
                                  const std::vector<Finding>& standing = {}) const {
        Sample window;
        window.stations = std::move(stations);
        window.uart = uart;
        window.broadcasts = broadcasts;
        window.telnet = telnet;
        return diagnose(facts, window, standing);
    }
    /// "wrong-baud", or with its station "gap-too-short 2"; "noise, gap-too-short 2".
    static std::string text_of(const std::vector<Finding>& found) {
        std::string text;
        for (const Finding& f : found) {
            text += (text.empty() ? "" : ", ") + std::string(code(f.cause));
            if (f.station) text += ' ' + std::to_string(*f.station);
        }
        return text;
    }
    std::string causes(Stations stations, const std::vector<Finding>& standing = {}) const {
        return text_of(findings(std::move(stations), standing));
    }
    /// Of station 1 alone on its line.
    std::string alone(const arbiter::Symptoms& one) const { return causes({{1, one}}); }
    /// Of station 2 beside one that has no fault.
    std::string beside(const arbiter::Symptoms& two) const { return causes({{1, fine}, {2, two}}); }
    /// The only finding, which is this one.
    Finding only(const std::string& what, Stations stations) const {
        const std::vector<Finding> found = findings(std::move(stations));
        EXPECT_EQ(text_of(found), what);
        return found.empty() ? Finding{} : found.front();
    }
    /// A finding of the previous look.
    static Finding known(Cause cause, std::optional<std::uint8_t> station = {}) {
        return {cause, station, {}, {}, {}};
    }

    const arbiter::Symptoms fine = Mix().answered(50);
    LineFacts facts;
    std::optional<line::UartErrors> uart;
    std::uint64_t broadcasts = 0;
    bool telnet = false;
};

}  // namespace panelgate::doctor
