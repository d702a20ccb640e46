// The queue beside a model that is too simple to be wrong: a list, searched from its start.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <tuple>
#include <vector>

#include "panelgate/arbiter/queue/job_queue.hpp"
#include "support/read_span.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::job_queue_model_test {
namespace {

class Model {
  public:
    explicit Model(QueueSettings settings) : settings_(settings) {}

    Jobs jobs;  ///< by ticket

    void add(const Job& job) {
        enter({own(job), 0, 0});
        enter({own(job), job.client, 0});
        enter({own(job), job.client, 1 + job.station});
        jobs.push_back(job);
        std::ranges::sort(jobs, {}, &Job::ticket);
    }
    void remove(Ticket ticket) {
        std::erase_if(jobs, [&](const Job& job) { return job.ticket == ticket; });
        std::erase_if(turns_, [&](const auto& entry) {
            const auto& [host, client, lane] = entry.first;
            return std::ranges::none_of(jobs, [&, h = host, c = client, l = lane](const Job& job) {
                return own(job) == h && (c == 0 || c == job.client) &&
                       (l == 0 || l == 1 + job.station);
            });
        });
    }
    /// First of its lane, and no broadcast is in between.
    bool is_first(const Job& job) const {
        return std::ranges::none_of(jobs, [&](const Job& other) {
            const bool related =
                other.station == job.station || other.station == 0 || job.station == 0;
            return other.client == job.client && other.ticket < job.ticket && related;
        });
    }
    std::vector<const Job*> firsts(const JobQueue::Test& may_run) const {
        std::vector<const Job*> found;
        for (const Job& job : jobs) {
            if (is_first(job) && may_run(job)) found.push_back(&job);
        }
        return found;
    }
    /// The next one of a class.
    const Job* next(PriorityClass priority, const JobQueue::Test& may_run) const {
        const Job* best = nullptr;
        for (const Job* job : firsts(may_run)) {
            if (job->priority != priority) continue;
            if (best == nullptr || turn_of(*job) < turn_of(*best)) best = job;
        }
        return best;
    }
    void popped(const Job& job) {
        ++now_;
        for (const Key& key : {Key{own(job), 0, 0}, Key{own(job), job.client, 0},
                               Key{own(job), job.client, 1 + job.station}})
            turns_[key][static_cast<std::size_t>(job.priority)] = now_;
        remove(job.ticket);
    }
    bool counts(const Job& job) const {
        const auto span = span_of(job);
        return !span || std::ranges::none_of(jobs, [&](const Job& other) {
            const auto wider = span_of(other);
            if (!wider || other.ticket == job.ticket || !wider->contains(*span)) return false;
            return !(*wider == *span) || other.ticket < job.ticket;
        });
    }
    std::size_t counting(const JobQueue::Test& of) const {
        return static_cast<std::size_t>(
            std::ranges::count_if(jobs, [&](const Job& job) { return of(job) && counts(job); }));
    }
    std::size_t of_host(const Job& like) const {
        return counting([&](const Job& job) { return own(job) == own(like); });
    }
    std::size_t of_client(const Job& like) const {
        return counting([&](const Job& job) { return job.client == like.client; });
    }
    bool rides(const Job& job) const {
        const auto span = span_of(job);
        return span && std::ranges::any_of(jobs, [&](const Job& other) {
                   const auto wider = span_of(other);
                   return wider && wider->contains(*span);
               });
    }
    static std::optional<ReadSpan> span_of(const Job& job) {
        if (job.alone || job.station == 0) return std::nullopt;
        return test::read_span(job.station, job.request.pdu());
    }
    static Host own(const Job& job) { return job.host == 0 ? 1000 + job.client : job.host; }

    void check_admission(const Job& job, const JobQueue::PushResult& pushed) const {
        const std::size_t size = counting([](const Job&) { return true; });
        if (rides(job) || (size < settings_.limit && of_client(job) < settings_.per_client)) {
            EXPECT_TRUE(pushed.taken && pushed.shed.empty());
        } else if (of_client(job) >= settings_.per_client) {
            EXPECT_FALSE(pushed.taken);
        } else {
            EXPECT_EQ(pushed.taken, !pushed.shed.empty());
            if (!pushed.shed.empty()) check_shed(job, pushed.shed.front(), size);
        }
    }

  private:
    using Key = std::tuple<Host, Client, int>;

    void check_shed(const Job& job, const Job& shed, std::size_t size) const {
        const bool write = job.priority == PriorityClass::write;
        const bool shed_write = shed.priority == PriorityClass::write;
        const bool other_host = of_host(shed) > of_host(job) + 1;
        const bool other_client = own(shed) == own(job) && of_client(shed) > of_client(job) + 1;
        EXPECT_TRUE(other_host || other_client || (write && !shed_write));
        if (shed_write && !write) EXPECT_GT(2 * of_host(shed), size);
        EXPECT_TRUE(counts(shed));
        for (const Job& behind : jobs) {
            const bool related = behind.client == shed.client && behind.ticket > shed.ticket;
            if (related && behind.station == shed.station) EXPECT_TRUE(span_of(behind));
            if (related) EXPECT_TRUE(behind.station != 0 && shed.station != 0);
        }
    }
    void enter(const Key& key) {
        const auto [it, added] = turns_.try_emplace(key);
        if (added) it->second.fill(++now_);
    }
    std::array<std::uint64_t, 3> turn_of(const Job& job) const {
        const auto rank = static_cast<std::size_t>(job.priority);
        return {turns_.at({own(job), 0, 0})[rank], turns_.at({own(job), job.client, 0})[rank],
                turns_.at({own(job), job.client, 1 + job.station})[rank]};
    }

    QueueSettings settings_;
    std::map<Key, std::array<std::uint64_t, 3>> turns_;  ///< of hosts, clients and lanes
    std::uint64_t now_ = 0;
};

/// Does to both the same, and compares.
class JobQueueModel : public testing::Test {
  protected:
    unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }

    Job any_job() {
        Job job{.ticket = ++ticket_, .request = modbus::Request::read({})};
        job.client = 1 + below(9);
        job.host = job.client % 4;  // 0: its own
        job.station = static_cast<std::uint8_t>(below(12) == 0 ? 0 : 1 + below(4));
        job.priority = static_cast<PriorityClass>(below(3));
        if (job.station == 0) job.priority = PriorityClass::write;
        const bool write = job.priority == PriorityClass::write;
        const unsigned function = write ? 6 : 3 + below(2);
        const unsigned address = below(12);
        const unsigned count = 1 + below(7);
        job.request = test::request_of(Writer().u8(function).u16(address).u16(count).take());
        job.alone = below(10) == 0;
        job.start_by = TimePoint{Duration(below(1000))};
        return job;
    }
    JobQueue::Test any_test() {
        const std::uint64_t mask = random_() | (below(2) == 0 ? ~std::uint64_t{0} : 0);
        return [mask](const Job& job) { return (mask >> (job.ticket % 64) & 1u) != 0; };
    }
    void push() {
        const Job job = any_job();
        const auto pushed = queue_.push(Job(job));
        model_.check_admission(job, pushed);
        for (const Job& shed : pushed.shed) model_.remove(shed.ticket);
        if (pushed.taken) model_.add(job);
        shed_ += static_cast<int>(pushed.shed.size());
    }
    void pop() {
        const auto test = any_test();
        const JobQueue::Choice choice = queue_.choose(test);
        ASSERT_EQ(choice.job() != nullptr, !model_.firsts(test).empty());
        if (choice.job() == nullptr) return;
        const Ticket ticket = choice.job()->ticket;
        const Job popped = queue_.take(choice);
        ASSERT_EQ(popped.ticket, ticket);
        const Job* expected = model_.next(popped.priority, test);
        ASSERT_TRUE(expected != nullptr && expected->ticket == ticket);
        bool higher = false;
        for (const auto c : {PriorityClass::write, PriorityClass::read})
            higher = higher || (c < popped.priority && model_.next(c, test) != nullptr);
        ASSERT_EQ(queue_.last_was_passed_over(), higher);
        overtaken_ += higher ? 1 : 0;
        model_.popped(popped);
        if (below(4) == 0) taken_.push_back(popped);
    }
    void take_reads() {
        const auto test = any_test();
        const auto station = static_cast<std::uint8_t>(1 + below(4));
        const auto here = [&](const Job& job) {
            return job.station == station && job.request.span() && !job.alone && test(job);
        };
        std::vector<Ticket> expected;
        for (auto first = model_.firsts(here); !first.empty(); first = model_.firsts(here)) {
            expected.push_back(first.front()->ticket);
            model_.remove(expected.back());
        }
        std::ranges::sort(expected);
        std::vector<Ticket> got;
        for (const Job& job : queue_.take_reads(station, test)) got.push_back(job.ticket);
        ASSERT_EQ(got, expected);
    }
    void remove_some() {
        const auto keep = any_test();
        const auto match = [&](const Job& job) { return !keep(job) && job.ticket % 3 == 0; };
        Ticket last = 0;
        for (const Job& job : queue_.remove_if(match)) {
            ASSERT_TRUE(match(job));
            ASSERT_GT(job.ticket, last);
            last = job.ticket;
            model_.remove(job.ticket);
        }
        ASSERT_TRUE(std::ranges::none_of(model_.jobs, match));
    }
    void put_back() {
        if (taken_.empty()) return;
        queue_.put_back(Job(taken_.back()));
        model_.add(taken_.back());
        taken_.pop_back();
    }
    void step(unsigned what) {
        if (what < 11) return push();
        if (what < 17) return pop();
        if (what == 17) return take_reads();
        if (what == 18) return remove_some();
        put_back();
    }
    /// Also what one client has for one station, by turns.
    void compare(unsigned turn) const {
        ASSERT_EQ(queue_.waiting(), model_.jobs.size());
        ASSERT_EQ(queue_.size(), model_.counting([](const Job&) { return true; }));
        std::optional<TimePoint> first;
        for (const Job& job : model_.jobs)
            first = std::min(first.value_or(job.start_by), job.start_by);
        ASSERT_EQ(queue_.first_expiry(), first);
        std::vector<Ticket> firsts;
        queue_.any_first([&](const Job& job) {
            firsts.push_back(job.ticket);
            return false;
        });
        std::ranges::sort(firsts);
        ASSERT_EQ(firsts, tickets(model_.firsts([](const Job&) { return true; })));
        const Client client = 1 + turn % 9;
        const auto station = static_cast<std::uint8_t>(1 + turn % 4);
        const auto theirs = [&](const Job& job) {
            return job.client == client && (job.station == station || job.station == 0);
        };
        ASSERT_EQ(queue_.has(client, station), std::ranges::any_of(model_.jobs, theirs));
    }

    static std::vector<Ticket> tickets(const std::vector<const Job*>& jobs) {
        std::vector<Ticket> all;
        for (const Job* job : jobs) all.push_back(job->ticket);
        return all;
    }

    std::mt19937 random_{20260101};
    Ticket ticket_ = 0;
    const QueueSettings settings_{.limit = 24, .per_client = 6, .deadline = 2s};
    JobQueue queue_{settings_};
    Model model_{settings_};
    Jobs taken_;
    int overtaken_ = 0;
    int shed_ = 0;
};

TEST_F(JobQueueModel, PopsAndCountsLikeASimpleList) {
    for (unsigned i = 0; i < 20'000 && !HasFailure(); ++i) {
        step(below(20));
        compare(i);
    }
    EXPECT_GT(overtaken_, 50);
    EXPECT_GT(shed_, 500);
}

}  // namespace
}  // namespace panelgate::arbiter::job_queue_model_test
