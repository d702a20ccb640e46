#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/mqtt/settings.hpp"
#include "panelgate/mqtt/subjects.hpp"
#include "panelgate/tls/context.hpp"

struct mosquitto;

namespace panelgate::mqtt {

/// Messages of one connection the broker may not have received. A QoS 0 message counts as delivered
/// when a barrier sent after it is acknowledged. Pure.
class OpenMessages {
  public:
    /// `change`: 0 if the message is not a change.
    void sent(int id, bool acknowledged, std::uint64_t change) {
        if (acknowledged) {
            open_[id] = {change};
        } else {
            unconfirmed_.push_back(change);
        }
    }
    /// True if unconfirmed messages follow the last barrier and none is outstanding.
    bool wants_barrier() const { return !barrier_ && !unconfirmed_.empty(); }
    /// A barrier was sent after all of them; 0: sending failed.
    void barrier(int id) {
        if (id == 0) return;
        barrier_ = id;
        behind_.swap(unconfirmed_);
    }
    /// Returns the changes now delivered to the broker.
    std::vector<std::uint64_t> delivered(int id) {
        if (barrier_ == id) {
            barrier_.reset();
            return std::exchange(behind_, {});
        }
        const auto found = open_.find(id);
        if (found == open_.end()) return {};
        std::vector<std::uint64_t> changes = std::move(found->second);
        open_.erase(found);
        return changes;
    }
    std::size_t size() const { return open_.size() + unconfirmed_.size() + behind_.size(); }
    void clear() { *this = {}; }

  private:
    std::map<int, std::vector<std::uint64_t>> open_;  ///< until acknowledged
    std::vector<std::uint64_t> unconfirmed_;          ///< sent after the last barrier
    std::vector<std::uint64_t> behind_;               ///< sent before it
    std::optional<int> barrier_;
};

/// One connection to the broker: a libmosquitto session that is never reused. Passive; one thread
/// at a time. Functions that return a string return "" on success, otherwise the reason why the
/// connection is over.
class Connection {
  public:
    enum class Protocol : std::uint8_t { mqtt5, mqtt311 };

    /// By MQTT 5 the broker knows the largest message that is taken, and keeps larger ones to
    /// itself. With mqtt311 libmosquitto would hold whatever comes.
    Connection(const Settings& settings, const std::string& client_id, Protocol protocol);
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    /// Resolves the name and connects; blocks as long as the system does.
    std::string connect(const Message& will);
    /// Returns the socket, -1 if there is none.
    int socket() const;
    bool wants_write() const;
    std::string read(TimePoint now);
    std::string write();
    /// Must be called once per second.
    std::string housekeep();

    /// Returns the id used in Happened::delivered; 0: not sent, failed() says why.
    int publish(const Message& message);
    const std::string& failed() const { return failed_; }
    void subscribe(const std::string& filter);
    /// Sends a barrier for QoS 0 messages, which have no acknowledgement: its own arrives after all
    /// published before. An UNSUBSCRIBE from nothing (MQTT 3.1.1, 3.10.4). 0: not sent.
    int barrier();
    /// Disconnects cleanly: the broker does not publish the will.
    void disconnect();

    struct Received {
        std::string topic;
        std::string payload;
        bool retained = false;
    };
    /// Events since the last take().
    struct Happened {
        bool accepted = false;
        std::string refused;                      ///< reason given by the broker
        bool is_too_new = false;                  ///< the broker does not know the protocol
        std::vector<std::string> unsubscribed{};  ///< filters that the broker refuses
        std::vector<int> delivered;               ///< of publish() and barrier()
        std::vector<Received> received;
        std::uint64_t left_out = 0;  ///< messages beyond Settings::messages a second
    };
    Happened take();

  private:
    struct Callbacks;
    /// errno must be that of the failed call.
    std::string reason(int code) const;
    std::string set_up(const Message& will);
    std::string set_up_tls();
    bool has_turn();

    const Settings settings_;
    const Protocol protocol_;
    Happened happened_;
    std::map<int, std::string> asked_;  ///< filters by the id of their SUBSCRIBE
    TimePoint now_{};                   ///< of the last read()
    TimePoint second_{};                ///< beginning of the one that is counted in
    std::size_t in_second_ = 0;         ///< messages
    std::string failed_;
    std::string ended_;      ///< why the broker has ended it, in words of MQTT 5
    std::string tls_error_;  ///< OpenSSL's word for it, by libmosquitto
    std::unique_ptr<tls::ClientContext> client_;  ///< null: plain; outlives the session
    std::unique_ptr<mosquitto, void (*)(mosquitto*)> session_;
};

}  // namespace panelgate::mqtt
