#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "agenda.hpp"
#include "house_plan.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "truth.hpp"
#include "witness.hpp"

namespace panelgate::scenario {

/// Knows what the panels really did, and keeps the first promise that was broken.
class HouseJudge final : public Witness {
  public:
    explicit HouseJudge(const HousePlan& plan, const Agenda& agenda)
        : plan_(plan), agenda_(agenda) {}

    void on_served(TimePoint now, std::uint8_t station) override { truth_.on_served(now, station); }
    void on_executed(TimePoint now, std::uint8_t station, ByteView pdu) override;
    void on_exception(TimePoint now, std::uint8_t station, ByteView pdu) override {
        truth_.on_exception(now, station, pdu);
    }
    void on_copy(TimePoint, ByteView) override {}
    void on_reply(TimePoint, ByteView) override {}
    void on_said(TimePoint now, ByteView bytes) override { truth_.on_said(now, bytes); }
    void on_garbled(TimePoint) override { ++garbled_; }
    void on_collision(TimePoint, std::uint8_t) override {}

    /// A request on its way, and what was known of its station when it began.
    struct Question {
        std::uint8_t station = 0;
        Bytes pdu;
        TimePoint at;
        std::uint64_t served = 0;
    };
    Question ask(std::uint8_t station, const Bytes& pdu) const {
        return {station, pdu, agenda_.now(), truth_.served(station)};
    }
    /// P1, P2, P6: a reply to this question, now. `oldest`: it may be as old as that; nothing: it
    /// is newer than the question.
    void judge(const Question& question, const Bytes& reply, std::optional<TimePoint> oldest);
    /// P1: the station has said this exception to this request.
    void judge_exception(const Question& question);
    /// P1, P6: values that were read, and that nobody asked for before `sampled`.
    void judge_values(std::uint8_t station, std::uint16_t address,
                      const std::vector<std::uint16_t>& values, TimePoint sampled);
    std::optional<Duration> max_age(std::uint8_t station) const;
    /// Nobody ran the loop between these two.
    void on_paused(TimePoint from, TimePoint to) { pauses_.emplace_back(from, to); }
    /// Somebody says this write, which nobody else says: each may execute it once more.
    void allow_write(std::uint8_t station, const Bytes& pdu) {
        never_sent_.erase(scenario::key_of(station, pdu));
        ++allowed_[pdu];
    }
    /// P2: a broadcast leaves on the line.
    void on_broadcast(ByteView pdu);
    /// P3: answered by `deadline`, or as soon as the process ran again.
    bool in_time(TimePoint deadline) const;
    /// P2: this write was answered as one that never left.
    void on_never_sent(const Question& question) {
        const auto allowed = allowed_.find(question.pdu);
        if (allowed == allowed_.end() || allowed->second == 1) never_sent_.insert(key_of(question));
    }

    void fail(std::string what) {
        if (violation_.empty()) violation_ = std::move(what);
    }
    const std::string& violation() const { return violation_; }

    std::uint64_t good = 0;  ///< answers with values, or confirmed

  private:
    static std::string key_of(const Question& q) { return scenario::key_of(q.station, q.pdu); }
    void judge_read(const Question& question, const Bytes& reply, std::optional<TimePoint> oldest);
    void check(const Truth::Read& read, std::uint16_t first, ByteView values);

    const HousePlan& plan_;
    const Agenda& agenda_;
    Truth truth_;
    std::uint64_t garbled_ = 0;
    std::set<Bytes> lucky_;
    std::set<std::string> never_sent_;
    std::map<Bytes, unsigned> allowed_;         ///< how often each write was asked for
    std::map<Bytes, unsigned> spread_;          ///< how often each broadcast has left
    std::map<std::string, unsigned> executed_;  ///< how often each write was executed
    std::vector<std::pair<TimePoint, TimePoint>> pauses_;
    std::string violation_;
};

/// Stands between the bus and all who use it, and holds each answer against the promises. Broken on
/// purpose in the ways that a flaw names.
class HouseSeam final : public bus::BusClient {
  public:
    enum class Flaw : std::uint8_t {
        none,
        answers_twice,
        answers_never,      ///< one of many
        answers_at_once,    ///< from inside transact()
        answers_the_other,  ///< with the reply to the request before
        remembers,          ///< a reply longer than it may
        polls_first,        ///< a poll gives way to nobody
        deaf,               ///< the driver does not read before it looks at the clock
        untold,             ///< the poller does not hear of writes
        keeps_withdrawn,    ///< a serial master's request stays when it says something else
        answers_the_next,   ///< a serial master's with the reply to the one it gave up
        spreads_twice,      ///< a serial master's broadcast
        writes_twice,       ///< what a serial master writes
        silent_to_masters,  ///< serial ones, now and then
        serves_others       ///< answers for a slave on the master's own wire
    };
    HouseSeam(bus::BusClient& bus, const HousePlan& plan, HouseJudge& judge, const Agenda& agenda,
              Flaw flaw)
        : bus_(bus), plan_(plan), judge_(judge), agenda_(agenda), flaw_(flaw) {}

    void transact(bus::Request request, bus::AnswerHandler handler) override;
    void cancel(bus::ClientId client) override;
    void name_client(bus::ClientId client, std::string name) override;
    bus::LineStatus status() const override { return bus_.status(); }
    bus::StationStatus station_status(std::uint8_t station) const override {
        return bus_.station_status(station);
    }
    bus::TracePart trace(std::size_t last) const override { return bus_.trace(last); }

    bool idle() const { return open_.empty(); }
    std::uint64_t answers() const { return answers_; }
    std::uint64_t polls() const { return polls_; }
    std::uint64_t relayed() const { return relayed_; }

  private:
    struct Open {
        HouseJudge::Question question;
        bus::ClientId client = 0;
        bool poll = false;
        std::uint64_t polls = 0;  ///< answered before
        bool withdrawn = false;
    };
    bool is_masters(const Open& open) const {
        return masters_.contains(open.client) && open.question.station != 0;
    }
    void judge_master(const Open& open);
    bool spoils_master(const Open& open, bool given_up, bus::Answer& answer);
    void ask_twice(const bus::Request& request);
    void on_answer(std::uint64_t id, const bus::Answer& answer);
    void judge(const Open& open, const bus::Answer& answer);
    void judge_relay(const Open& open);
    /// The good answer becomes another one, or several, or none.
    void hand_over(const Open& open, bus::Answer answer, const bus::AnswerHandler& handler,
                   std::uint64_t id);

    bus::BusClient& bus_;
    const HousePlan& plan_;
    HouseJudge& judge_;
    const Agenda& agenda_;
    Flaw flaw_;
    std::uint64_t last_ = 0;
    bool inside_ = false;
    std::map<std::uint64_t, Open> open_;
    std::uint64_t answers_ = 0;
    std::uint64_t polls_ = 0;
    std::uint64_t relayed_ = 0;
    TimePoint relay_asked_{};
    std::optional<bus::Answer> last_read_;
    std::map<std::string, bus::Answer> remembered_;
    std::set<bus::ClientId> masters_;  ///< serial ones
    std::optional<bus::Answer> given_up_;
};

/// What the relay copies, and where to.
inline constexpr std::uint16_t kRelayFrom = 500;
inline constexpr std::uint16_t kRelayTo = kMemory + 100;
inline constexpr std::uint16_t kRelayCount = 2;
/// What is polled.
inline constexpr std::uint16_t kPolled = 300;
inline constexpr std::uint16_t kPolledCount = 4;
/// … and of what clients write; calm houses have time for the first only.
inline constexpr std::uint16_t kPolledMemory = kMemory;

}  // namespace panelgate::scenario
