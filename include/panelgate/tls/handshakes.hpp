#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/rt/process.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/tls/counters.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::tls {

class Pace;
class Stream;

/// The handshakes of a listener. What they compute is done by a thread of low priority, so that a
/// flood of them costs the loop little, and their number is bounded: beyond the limit of an address
/// its oldest one gives way, beyond that of all the oldest one of the address with most. Each has
/// `handshake_timeout`, and begins when its address and all together have begun no more than they
/// may a second. One thread.
class Handshakes : public std::enable_shared_from_this<Handshakes> {
  public:
    /// `name` is the listener's, for the log. Throws Unusable.
    Handshakes(boost::asio::any_io_executor executor, std::string name, Settings settings);
    ~Handshakes();

    /// For handshakes that end from now on. Files that no context can be made of are logged, and
    /// the former ones stay in use. True if other clients are let in than before: review() those
    /// that are.
    bool apply(const Settings& settings);
    /// The same, with a context made elsewhere, such as in a worker.
    bool apply(const Settings& settings, std::shared_ptr<const Context> context);
    const Settings& settings() const { return settings_; }

    /// Makes the stream secure. `done` is called once, later, with whether it is; a failure is
    /// logged. `owner` owns the stream; `client` is its name, `address` its address.
    void begin(std::shared_ptr<void> owner, Stream& stream, std::string client, std::string address,
               std::function<void(bool secure)> done);
    /// A client that is let in: who owns its stream, and how it is told to leave.
    struct Guest {
        std::weak_ptr<void> owner;
        const Stream* stream = nullptr;
        std::function<void(const std::string& why)> leave;
    };
    /// Calls `leave`, later, of those who would not be let in any more. Their certificates are
    /// judged by the thread.
    void review(std::vector<Guest> guests);
    Counters counters() const;

  private:
    class Conversation;

    void make_room(const std::string& address);
    void end(Conversation& conversation, Outcome outcome, const std::string& why);

    std::string name_;
    Settings settings_;
    std::shared_ptr<const Context> context_;
    std::unique_ptr<Pace> pace_;
    std::list<Conversation*> running_;  ///< the oldest first; each removes itself
    Counters counters_;
    rt::Worker worker_;
};

}  // namespace panelgate::tls
