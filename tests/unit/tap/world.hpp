// A line in virtual time: a master, panels with the faults of docs/how/threats.md, and a tap. The
// world knows the request of each reply, which the tap has to find out.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::tap::test {

/// Chances per request, each with its threat.
struct Manner {
    double silent = 0;     ///< T1: the panel does not answer
    double late = 0;       ///< T2: the panel answers after the master has given up
    double damaged = 0;    ///< T3: on the wire, for all
    double noise = 0;      ///< T3: two bytes in front of the reply
    double misheard = 0;   ///< T3: a frame that only the tap hears damaged
    double holes = 0;      ///< T4: a pause inside the reply
    double announced = 0;  ///< T10: an exception 05, and the reply later
    double broadcast = 0;  ///< T11: a panel answers a broadcast
    double doubled = 0;    ///< T12: the reply comes once more directly behind itself
    double slow = 0;       ///< T14: the panel answers slowly, but before the master gives up
    bool echo = false;     ///< T6: a repeater returns each request
    Duration latency{};    ///< T4: interval at which the tap's adapter delivers bytes
    Duration give_up = 200ms;
    unsigned seed = 1;
};

struct Asked {
    std::uint8_t station = 0;
    Bytes pdu;
    TimePoint begin;
    std::set<Bytes> replies{};  ///< PDUs that the panel has sent for it, damaged or not
};

class World {
  public:
    static constexpr SerialFormat kSerial{38400, 8, Parity::none, 1};

    explicit World(const Manner& manner) : manner_(manner), random_(manner.seed) {}

    /// One request and its outcome, with the pause after it.
    void turn() {
        const auto [station, pdu] = choose();
        ask(station, pdu);
    }
    const std::vector<Asked>& asked() const { return asked_; }

    /// What the tap receives, in order.
    struct Chunk {
        TimePoint at;
        Bytes bytes;
    };
    std::vector<Chunk> take_chunks() {
        std::vector<Chunk> chunks;
        for (const auto& [at, byte] : heard_) {
            TimePoint handed = at;
            if (manner_.latency > Duration::zero())
                handed += manner_.latency - at.time_since_epoch() % manner_.latency;
            if (chunks.empty() || chunks.back().at != handed) chunks.push_back({handed, {}});
            chunks.back().bytes.push_back(byte);
        }
        heard_.clear();
        return chunks;
    }

  private:
    struct Speech {
        TimePoint begin;
        Bytes bytes;
        std::size_t to = 0;  ///< the request that it answers
        bool good = true;
        Duration hole{};  ///< a pause behind the third byte
        TimePoint end() const { return begin + wire_time(kSerial, bytes.size()) + hole; }
    };

    bool chance(double p) { return std::uniform_real_distribution<>(0, 1)(random_) < p; }
    Duration between(Duration low, Duration high) {
        return Duration(
            std::uniform_int_distribution<std::int64_t>(low.count(), high.count())(random_));
    }
    unsigned number(unsigned below) { return static_cast<unsigned>(random_() % below); }
    std::uint16_t word(unsigned below) { return static_cast<std::uint16_t>(number(below)); }

    std::pair<std::uint8_t, Bytes> choose() {
        if (!asked_.empty() && chance(0.2)) return {asked_.back().station, asked_.back().pdu};
        const auto station = static_cast<std::uint8_t>(1 + number(4));
        const unsigned kind = number(12);
        const bool everyone = kind == 3 && chance(0.3);
        return {everyone ? std::uint8_t{0} : station, make_request(kind)};
    }

    Bytes make_request(unsigned kind) {
        Writer out;
        switch (kind) {
            case 0:
                return modbus::encode_write_register(100, word(3));
            case 1:
                return modbus::encode_write_coil(7, chance(0.5));
            case 2:
                return modbus::encode_write_registers(200, {1, word(99)});
            case 3:
                return modbus::encode_write_coils(50, {true, false, chance(0.5)});
            case 4:
                return modbus::encode_read(modbus::Table::coils, word(1000), 20);
            case 5:
                return out.u8(0x16).u16(4).u16(0xF2).u16(number(3)).take();
            case 6:
                return out.u8(0x41).u16(number(5)).take();
            default:
                out.u8(0x03).u16(number(2) * 100);
                return out.u16(number(2) == 0 ? 10u : 2 + number(20)).take();
        }
    }

    /// Values differ from one reply to the next, so that each is identifiable.
    Bytes reply_to(const Bytes& pdu) {
        ++said_;
        if (chance(0.02)) return {static_cast<std::uint8_t>(pdu[0] | 0x80), 2};
        Writer out;
        if (modbus::is_broadcastable(pdu[0])) return modbus::normal_write_reply(pdu);
        if (pdu[0] == 0x16) return pdu;
        if (pdu[0] == 0x41) return out.u8(0x41).u16(said_ & 0xFFFF).u8(said_ >> 16).take();
        const std::size_t size = *modbus::reply_length_from_request(pdu) - 5;
        out.u8(pdu[0]).u8(static_cast<unsigned>(size)).u8(said_ >> 16).u16(said_ & 0xFFFF);
        for (std::size_t i = 3; i < size; ++i) out.u8(number(3));
        return out.take();
    }

    /// Sends a request, whatever is still on the wire; its master listens until it has an answer or
    /// gives up.
    void ask(std::uint8_t station, const Bytes& pdu) {
        const std::size_t which = asked_.size();
        asked_.push_back({station, pdu, now_});
        Speech request{now_, modbus::encode_adu(station, pdu), which};
        if (chance(manner_.damaged / 4)) request.good = false;
        collide(request);
        const bool taken = request.good;
        TimePoint end = request.end();
        put(request);
        if (manner_.echo) {
            request.begin = end + between(0ms, 2ms);
            end = request.end();
            put(std::move(request));
        }
        if (taken && station != 0) let_answer(which, end);
        if (taken && station == 0) let_answer_broadcast(which, end);
        const TimePoint until = end + (station == 0 ? Duration(20ms) : manner_.give_up);
        const auto done = station == 0 ? std::nullopt : listen(which, until);
        now_ = done ? *done + between(2ms, chance(0.05) ? 400ms : 12ms) : until + between(1ms, 5ms);
        if (station == 0) listen(which, now_);
    }

    void let_answer(std::size_t which, TimePoint heard) {
        const Asked& asked = asked_[which];
        if (chance(manner_.silent)) return;
        if (busy_[asked.station] > heard) return;  // it hears nothing while it is at work
        Duration think = between(2ms, 6ms);
        if (chance(manner_.slow)) think = between(6ms, manner_.give_up / 2);
        if (chance(manner_.late)) think = manner_.give_up + between(5ms, manner_.give_up);
        if (chance(manner_.announced)) {
            const Bytes wait{static_cast<std::uint8_t>(asked.pdu[0] | 0x80), 5};
            coming_.push_back({heard + think, modbus::encode_adu(asked.station, wait), which});
            think += between(20ms, manner_.give_up);
        }
        Speech reply{heard + think, modbus::encode_adu(asked.station, reply_to(asked.pdu)), which};
        if (chance(manner_.holes)) reply.hole = between(2ms, 100ms);
        if (chance(manner_.damaged)) reply.good = false;
        busy_[asked.station] = reply.end();
        if (chance(manner_.noise))
            coming_.push_back({reply.begin - 2ms, {0xFF, 0x00}, which, false});
        if (chance(manner_.doubled)) {
            Speech again = reply;
            again.begin = reply.end() + 1ms;
            coming_.push_back(again);
        }
        coming_.push_back(std::move(reply));
        std::ranges::sort(coming_, {}, &Speech::begin);
    }

    void let_answer_broadcast(std::size_t which, TimePoint heard) {
        const Bytes reply = modbus::normal_write_reply(asked_[which].pdu);
        for (std::uint8_t station = 1; station <= 4; ++station) {
            if (!chance(manner_.broadcast)) continue;
            const TimePoint begin = heard + between(2ms, 100ms);
            coming_.push_back({begin, modbus::encode_adu(station, reply), which});
            busy_[station] = coming_.back().end();
        }
        std::ranges::sort(coming_, {}, &Speech::begin);
    }

    /// When the master has a frame that it takes for the answer.
    std::optional<TimePoint> listen(std::size_t which, TimePoint until) {
        const Asked& asked = asked_[which];
        while (!coming_.empty() && coming_.front().begin < until) {
            Speech speech = std::move(coming_.front());
            coming_.erase(coming_.begin());
            collide(speech);
            const TimePoint end = speech.end();
            if (speech.bytes.size() < modbus::kMinAdu) {
                put(std::move(speech));
                continue;
            }
            const Bytes pdu(speech.bytes.begin() + 1, speech.bytes.end() - 2);
            const bool fits =
                speech.good && speech.bytes[0] == asked.station && modbus::answers(asked.pdu, pdu);
            asked_[speech.to].replies.insert(pdu);  // a reply cut in its CRC is still true
            put(std::move(speech));
            if (fits && asked.station != 0) return end;
        }
        return std::nullopt;
    }

    /// Two simultaneous senders damage both frames.
    void collide(Speech& speech) {
        if (speech.begin < said_until_) speech.good = false;
        for (Speech& other : coming_) {
            if (other.begin >= speech.end() || other.end() <= speech.begin) continue;
            other.good = false;
            speech.good = false;
        }
    }

    void put(Speech speech) {
        said_until_ = std::max(said_until_, speech.end());
        const bool misheard = chance(manner_.misheard);
        if (!speech.good || misheard) {
            const std::size_t first = number(static_cast<unsigned>(speech.bytes.size()));
            for (std::size_t i = first; i < std::min(speech.bytes.size(), first + 1 + number(3));
                 ++i)
                speech.bytes[i] = static_cast<std::uint8_t>(speech.bytes[i] ^ (1 + number(255)));
            if (chance(0.3)) speech.bytes.resize(first);
            if (modbus::crc_ok(speech.bytes)) speech.bytes.back() ^= 1;
        }
        TimePoint at = speech.begin;
        for (std::size_t i = 0; i < speech.bytes.size(); ++i) {
            at += character_time(kSerial) + (i == 3 ? speech.hole : Duration{});
            heard_.emplace(at, speech.bytes[i]);
        }
    }

    Manner manner_;
    std::mt19937 random_;
    TimePoint now_{1h};
    unsigned said_ = 0;
    std::vector<Asked> asked_;
    std::vector<Speech> coming_;              ///< what panels will send, by time
    std::map<std::uint8_t, TimePoint> busy_;  ///< panels, until then
    std::multimap<TimePoint, std::uint8_t> heard_;
    TimePoint said_until_{};  ///< on the wire
};

}  // namespace panelgate::tap::test
