#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/mqtt/message.hpp"
#include "panelgate/mqtt/settings.hpp"

struct mosquitto;

namespace panelgate::mqtt {

/// One connection to the broker, from its making to its end: a session of libmosquitto that is
/// never used again. Does nothing by itself; one thread at a time. "" is success, anything else is
/// why the connection is over.
class Connection {
  public:
    Connection(const Settings& settings, const std::string& client_id);
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    /// Looks the name up and connects; waits for as long as the system does.
    std::string connect(const Message& will);
    /// -1: none.
    int socket() const;
    bool wants_write() const;
    std::string read();
    std::string write();
    /// Once a second.
    std::string look_after();

    /// What it is called in Happened::delivered; 0: it could not be sent.
    int publish(const Message& message);
    bool subscribe(const std::string& filter);
    /// Acknowledged behind everything that was published before: for messages of quality of service
    /// 0, which nobody acknowledges. An UNSUBSCRIBE from nothing (MQTT 3.1.1, 3.10.4). 0: not sent.
    int barrier();
    /// Takes leave: nobody is told that it was lost.
    void disconnect();

    struct Received {
        std::string topic;
        std::string payload;
        bool retained = false;
    };
    /// What has come since the last call.
    struct Happened {
        bool accepted = false;
        std::string refused;         ///< by the broker, and why
        std::vector<int> delivered;  ///< of publish() and barrier()
        std::vector<Received> received;
    };
    Happened take();

  private:
    struct Callbacks;
    std::string set_up(const Message& will);
    std::string set_up_tls();

    const Settings settings_;
    Happened happened_;
    std::unique_ptr<mosquitto, void (*)(mosquitto*)> session_;
};

}  // namespace panelgate::mqtt
