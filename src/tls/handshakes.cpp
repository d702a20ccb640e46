#include "panelgate/tls/handshakes.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/system/error_code.hpp>
#include <cctype>
#include <cerrno>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "engine.hpp"
#include "pace.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tls/stream.hpp"
#include "proof.hpp"

namespace panelgate::tls {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kChunk = 16 * 1024;
/// What a client may send until the handshake is over; a chain of certificates has some kilobytes.
constexpr std::size_t kMostInput = 128 * 1024;
constexpr int kNice = 10;
constexpr std::uint8_t kHandshakeRecord = 22;  // RFC 8446 5.1

/// Of the calling thread: the loop, whose time is the lines', goes first, and is never preempted by
/// this one (sched(7), SCHED_BATCH).
void be_nice() {
    thread_local const bool kDone = [] {
        const sched_param none{};
        ::sched_setscheduler(0, SCHED_BATCH, &none);
        ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
        return true;
    }();
    static_cast<void>(kDone);
}

std::string spoken(ByteView first) {
    const std::string_view text(reinterpret_cast<const char*>(first.data()), first.size());
    const std::size_t word = text.find(' ');
    const bool is_method = word != text.npos && word > 2 &&
                           std::all_of(text.begin(), text.begin() + static_cast<long>(word),
                                       [](unsigned char c) { return std::isupper(c) != 0; });
    if (is_method) return "it speaks HTTP without TLS; write https:// in its address";
    if (first.size() > 5 && first[2] == 0 && first[3] == 0 && first[4] == 0)
        return "it speaks Modbus/TCP without TLS; give it TLS, or a listener without tls";
    return "it does not speak TLS; give it TLS, or a listener without tls";
}

std::shared_ptr<const Context> context_of(const Settings& settings) {
    return settings.made ? settings.made : std::make_shared<const Context>(settings);
}

rt::LogLevel level_of(Outcome outcome) {
    const bool is_passing =
        outcome == Outcome::broken || outcome == Outcome::timeout || outcome == Outcome::displaced;
    return is_passing ? rt::LogLevel::info : rt::LogLevel::warn;
}

}  // namespace

/// One handshake. Its handlers keep it, and it its owner, until the end.
class Handshakes::Conversation : public std::enable_shared_from_this<Conversation> {
  public:
    Conversation(std::shared_ptr<Handshakes> all, std::shared_ptr<void> owner, Stream& stream,
                 std::string client, std::string address, std::function<void(bool)> done)
        : client(std::move(client)),
          address(std::move(address)),
          all_(std::move(all)),
          owner_(std::move(owner)),
          stream_(stream),
          context_(all_->context_),
          engine_(std::make_shared<Engine>(context_)),
          deadline_(stream.get_executor()),
          turn_(stream.get_executor()),
          done_(std::move(done)) {
        all_->running_.push_back(this);
    }
    ~Conversation() { all_->running_.remove(this); }
    Conversation(const Conversation&) = delete;
    Conversation& operator=(const Conversation&) = delete;

    void start() {
        deadline_.expires_after(all_->settings_.handshake_timeout);
        deadline_.async_wait([self = weak_from_this()](const error_code& cancelled) {
            const auto alive = self.lock();
            if (alive && !cancelled) alive->finish(Outcome::timeout, "the handshake took too long");
        });
        listen();
    }
    void finish(Outcome outcome, const std::string& why);

    const std::string client;
    const std::string address;

  private:
    void listen();
    void on_readable();
    void wait_for_turn();
    void compute();
    void send(Engine::Progress progress);
    void judge(Engine::Progress progress);
    void judge_again();
    void let_in();

    std::shared_ptr<Handshakes> all_;
    std::shared_ptr<void> owner_;
    Stream& stream_;
    std::shared_ptr<const Context> context_;
    std::shared_ptr<Engine> engine_;
    asio::steady_timer deadline_;
    asio::steady_timer turn_;
    bool waits_for_turn_ = false;
    std::function<void(bool)> done_;  ///< null: over
    std::size_t received_ = 0;
};

void Handshakes::Conversation::listen() {
    stream_.socket().async_wait(
        tcp::socket::wait_read, [self = shared_from_this()](const error_code& error) {
            if (!self->done_) return;
            if (!error) return self->on_readable();
            self->finish(Outcome::displaced, "its listener ends, or `allow` shuts it out");
        });
}

void Handshakes::Conversation::on_readable() {
    std::array<std::uint8_t, kChunk> chunk;
    const auto size =
        ::recv(stream_.socket().native_handle(), chunk.data(), chunk.size(), MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return listen();
    if (size <= 0) {
        const char* const when = received_ == 0 ? "before the first byte" : "during the handshake";
        return finish(Outcome::broken, std::string("the client left ") + when);
    }
    const ByteView bytes(chunk.data(), static_cast<std::size_t>(size));
    const bool is_first = received_ == 0;
    if (is_first && bytes[0] != kHandshakeRecord) return finish(Outcome::plain, spoken(bytes));
    received_ += bytes.size();
    if (received_ > kMostInput) return finish(Outcome::broken, "the client sent too much");
    engine_->input.append(bytes.begin(), bytes.end());
    is_first ? wait_for_turn() : compute();
}

void Handshakes::Conversation::wait_for_turn() {
    turn_.expires_after(Duration::zero());
    const Duration pause = all_->pace_->wait(turn_.expiry(), address);
    if (pause == Duration::zero()) return compute();
    waits_for_turn_ = true;
    turn_.expires_after(pause);
    turn_.async_wait([self = shared_from_this()](const error_code&) {
        if (!self->done_) return;
        self->waits_for_turn_ = false;
        self->compute();
    });
}

/// The engine is the thread's until it is done; the socket stays here.
void Handshakes::Conversation::compute() {
    auto progress = std::make_shared<Engine::Progress>();
    all_->worker_.run(
        [engine = engine_, progress] {
            be_nice();
            *progress = engine->handshake();
        },
        [self = shared_from_this(), progress] {
            if (self->done_) self->send(*progress);
        });
}

void Handshakes::Conversation::send(Engine::Progress progress) {
    if (engine_->output.empty()) return judge(progress);
    const asio::const_buffer bytes = asio::buffer(engine_->output);
    asio::async_write(stream_.socket(), bytes,
                      [self = shared_from_this(), progress](const error_code& error, std::size_t) {
                          if (!self->done_) return;
                          self->engine_->output.clear();
                          if (error && progress != Engine::Progress::failed)
                              return self->finish(Outcome::broken, "the client left");
                          self->judge(progress);
                      });
}

void Handshakes::Conversation::judge(Engine::Progress progress) {
    switch (progress) {
        case Engine::Progress::needs_input:
            return listen();
        case Engine::Progress::done:
            return context_ == all_->context_ ? let_in() : judge_again();
        case Engine::Progress::failed:
            return finish(engine_->outcome(), engine_->why());
    }
}

/// It began by former rules.
void Handshakes::Conversation::judge_again() {
    context_ = all_->context_;
    auto refusal = std::make_shared<std::optional<Refusal>>();
    all_->worker_.run([proof = std::make_shared<const Proof>(engine_->native()), context = context_,
                       refusal] { *refusal = proof->refusal_by(*context); },
                      [self = shared_from_this(), refusal] {
                          if (!self->done_) return;
                          if (*refusal) return self->finish((*refusal)->outcome, (*refusal)->why);
                          self->judge(Engine::Progress::done);
                      });
}

void Handshakes::Conversation::let_in() {
    engine_->output = std::string();
    stream_.secure(engine_);
    finish(Outcome::done, "");
}

void Handshakes::Conversation::finish(Outcome outcome, const std::string& why) {
    const auto done = std::exchange(done_, nullptr);
    if (!done) return;
    const auto self = shared_from_this();
    deadline_.cancel();
    turn_.cancel();
    if (waits_for_turn_) all_->pace_->give_back(address);
    const std::shared_ptr<void> owner = std::exchange(owner_, nullptr);
    all_->end(*this, outcome, why);
    done(outcome == Outcome::done);
}

Handshakes::Handshakes(asio::any_io_executor executor, std::string name, Settings settings)
    : name_(std::move(name)),
      settings_(std::move(settings)),
      context_(context_of(settings_)),
      pace_(std::make_unique<Pace>(settings_.handshakes_per_second_per_address,
                                   settings_.handshakes_per_second)),
      worker_(std::move(executor)) {}

Handshakes::~Handshakes() = default;

bool Handshakes::apply(const Settings& settings) try {
    if (settings == settings_) return false;
    return apply(settings, context_of(settings));
} catch (const Unusable& why) {
    rt::log(rt::LogLevel::error, "certificate not renewed",
            {{"listener", name_}, {"reason", why.what()}});
    return false;
}

bool Handshakes::apply(const Settings& settings, std::shared_ptr<const Context> context) {
    const auto rules = [](const Settings& of) {
        return std::tie(of.client, of.lowest, of.material.ca, of.material.crl);
    };
    const bool is_other = rules(settings_) != rules(settings);
    settings_ = settings;
    context_ = std::move(context);
    return is_other;
}

void Handshakes::review(std::vector<Guest> guests) {
    struct Judged {
        Guest guest;
        std::shared_ptr<const Proof> proof;
        std::optional<Refusal> refusal{};
    };
    auto all = std::make_shared<std::vector<Judged>>();
    for (Guest& guest : guests)
        if (auto proof = guest.stream->proof())
            all->push_back({std::move(guest), std::move(proof)});
    if (all->empty()) return;
    worker_.run(
        [all, context = context_] {
            be_nice();
            for (Judged& one : *all) one.refusal = one.proof->refusal_by(*context);
        },
        [all] {
            for (const Judged& one : *all)
                if (const auto owner = one.guest.owner.lock(); owner && one.refusal)
                    one.guest.leave(one.refusal->why);
        });
}

void Handshakes::begin(std::shared_ptr<void> owner, Stream& stream, std::string client,
                       std::string address, std::function<void(bool)> done) {
    make_room(address);
    const auto made =
        std::make_shared<Conversation>(shared_from_this(), std::move(owner), stream,
                                       std::move(client), std::move(address), std::move(done));
    made->start();
}

void Handshakes::make_room(const std::string& address) {
    const auto is_same = [&](const Conversation* one) { return one->address == address; };
    std::string from;
    if (static_cast<std::size_t>(std::ranges::count_if(running_, is_same)) >=
        settings_.max_handshakes_per_address) {
        from = address;
    } else if (running_.size() >= settings_.max_handshakes) {
        std::map<std::string, std::size_t> counts;
        for (const auto& one : running_) ++counts[one->address];
        const auto most = std::ranges::max_element(counts, {}, [](const auto& one) {
                              return one.second;
                          })->second;
        const auto has_most = [&](const Conversation* one) { return counts[one->address] == most; };
        from = (*std::ranges::find_if(running_, has_most))->address;
    } else {
        return;
    }
    Conversation* const oldest = *std::ranges::find(running_, from, &Conversation::address);
    oldest->finish(Outcome::displaced,
                   "too many handshakes at the same time; the oldest gives way");
}

void Handshakes::end(Conversation& conversation, Outcome outcome, const std::string& why) {
    ++counters_.handshakes[static_cast<std::size_t>(outcome)];
    running_.remove(&conversation);
    if (outcome == Outcome::done) return;
    const std::string& client = conversation.client;
    const std::string subject = name_ + ' ' + client.substr(0, client.rfind(':')) + ' ' + why;
    rt::log_about(subject, level_of(outcome), "tls handshake failed",
                  {{"listener", name_},
                   {"client", client},
                   {"outcome", std::string(label(outcome))},
                   {"reason", why}});
}

Counters Handshakes::counters() const {
    Counters counters = counters_;
    counters.certificate_expiry = context_->expiry();
    return counters;
}

}  // namespace panelgate::tls
