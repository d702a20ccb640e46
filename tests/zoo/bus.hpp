// One line of the zoo: its wire, its panels, and the master at the far end. A thread of its own
// runs it; command() may be called from another.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "ear.hpp"
#include "far_end.hpp"
#include "frame.hpp"
#include "habit.hpp"
#include "panel.hpp"
#include "reply_shape.hpp"
#include "wire.hpp"

namespace zoo {

struct BusSettings {
    int index = 0;
    std::vector<int> units;
    long baud = 0;  // 0: nothing takes time but thinking
    int bits = 10;  // of a character
    Time think = 500 * kMicrosecond;
    bool is_strict = false;    // a request behind too short a silence is lost
    std::string tap;           // a link that hears all that is on the wire, and is not heard
    Time tap_latency = 0;      // of its adapter
    std::FILE* log = nullptr;  // a line for each frame: START END BUS KIND hex..., seconds
};

class Bus {
  public:
    Bus(BusSettings settings, std::unique_ptr<FarEnd> far_end);
    ~Bus();
    Bus(const Bus&) = delete;
    Bus& operator=(const Bus&) = delete;

    std::string name() const { return far_end_->name(); }

    // One line in, one line out; see main.cpp for what there is.
    std::string command(std::string_view line);

  private:
    struct Station {
        explicit Station(int unit) : panel(unit) {}
        Panel panel;
        Time free_at = 0;
        std::deque<Time> ring;  // when what it has to do will be done
    };
    struct Source {  // of what nobody asked for
        Kind kind{};
        int unit = 0;
        Time next = 0;
        Time period = 0;
    };
    struct Counters {
        std::uint64_t requests = 0, bad = 0, broadcasts = 0, unknown = 0, gap_violations = 0,
                      connections = 0, tap_bytes = 0;
    };
    struct Write {
        Time at;
        int unit;
        Bytes pdu;
    };

    void run();
    void wait();
    void step(Time at);
    void hear_master(Time at);
    void serve_tap(Time at);
    void on_character(const Character& c);
    void on_master_character(const Character& c);
    void on_frame(const Bytes& frame, const Character& last, bool is_ours);
    void on_broadcast(const Bytes& pdu, Time end);
    void serve(int unit, Station& station, const Bytes& pdu, Time end);
    bool takes(const Habits& habits, Station& station, Time end);
    void say_reply(int unit, Station& station, const Bytes& reply, Time begin);
    void speak(const Speech& speech, const char* kind);
    void fire(Source& source, Time at);
    void ask_as_other_master(Time at);
    void find_sources(Time at);
    void stop_for(std::string_view milliseconds_text, bool is_severed);
    bool set(std::string_view arguments);
    std::string stats() const;
    std::string writes() const;
    Time next_wake(Time at) const;
    void note(Time start, Time end, const char* kind, const Bytes& bytes) const;

    BusSettings settings_;
    std::unique_ptr<FarEnd> far_end_;
    std::unique_ptr<FarEnd> tap_;
    std::mutex mutex_;
    Wire wire_;
    Dice dice_;
    Ear ear_;
    Ear tap_ear_;
    RequestFinder ours_;
    RequestFinder theirs_;
    std::map<int, Station> stations_;
    std::array<Habits, 248> habits_;  // of what is asked for these, also where nobody is
    std::vector<Source> sources_;
    Counters counters_;
    std::deque<Write> writes_;
    std::vector<Echo> echo_;  // of the frame that our master is saying
    std::size_t echoed_ = 0;
    Time gap_;
    Time last_activity_ = 0;
    Time frame_start_ = 0;
    bool is_lost_ = false;  // the frame that is coming began too early
    bool cuts_next_ = false;
    bool is_severed_ = false;
    int other_asks_ = 0;  // the unit that the other master wants to ask
    Time stopped_until_ = 0;
    Time last_step_ = 0;
    int wake_ = -1;
    std::atomic<bool> is_ending_{false};
    std::thread thread_;
};

}  // namespace zoo
