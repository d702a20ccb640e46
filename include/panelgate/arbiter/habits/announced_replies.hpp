#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::arbiter {

/// Exceptions behind which the reply itself may still come. Acknowledge (05) and busy (06) say so.
/// Any other code but 01 to 03, which refuse the request itself, is said by a gateway that gave up
/// sooner than its panel: where a reply has followed one, it is awaited behind the next ones.
/// After three in a row that nothing followed none is. Pure.
class AnnouncedReplies {
  public:
    static constexpr int kUnkept = 3;  ///< in a row

    /// True if the reply may follow this exception. False for a normal reply.
    bool announces(ByteView reply) const {
        const auto code = modbus::exception_of(reply);
        return code && unkept_ < kUnkept && (says_so(*code) || (followed_at_ && may_follow(*code)));
    }
    /// True for an exception behind which a reply is possible at all.
    static bool may_be_followed(ByteView reply) {
        const auto code = modbus::exception_of(reply);
        return code && may_follow(*code);
    }
    /// One that announces was given.
    void on_announced() { ++unkept_; }
    /// What it had announced came.
    void on_kept() { unkept_ = 0; }
    /// The reply followed an exception that did not announce it.
    void on_followed(TimePoint now) {
        followed_at_ = now;
        unkept_ = 0;
    }
    /// Forgets habits that have not shown for long.
    void forget(TimePoint now) {
        if (followed_at_ && now > *followed_at_ + timing::kForgetHabit) followed_at_.reset();
    }

  private:
    static constexpr bool may_follow(std::uint8_t code) {
        return code > static_cast<std::uint8_t>(modbus::ExceptionCode::illegal_data_value);
    }
    static constexpr bool says_so(std::uint8_t code) {
        return code == static_cast<std::uint8_t>(modbus::ExceptionCode::acknowledge) ||
               code == static_cast<std::uint8_t>(modbus::ExceptionCode::server_device_busy);
    }

    int unkept_ = 0;
    std::optional<TimePoint> followed_at_;
};

}  // namespace panelgate::arbiter
