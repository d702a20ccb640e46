#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <concepts>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/rt/loop.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::rt {
class Worker;
}  // namespace panelgate::rt
namespace panelgate::web {

/// The loops of a server: the faces' has connections, TLS, tokens and texts; the plant's has lines,
/// points and all that a request asks for. One executor: both are the same loop.
struct Loops {
    boost::asio::any_io_executor faces;
    boost::asio::any_io_executor plant;

    // NOLINTNEXTLINE(google-explicit-constructor): one loop may be both.
    template <class Executor>
        requires std::constructible_from<boost::asio::any_io_executor, const Executor&>
    Loops(const Executor& both) : faces(both), plant(both) {}
    Loops(boost::asio::any_io_executor of_faces, boost::asio::any_io_executor of_plant)
        : faces(std::move(of_faces)), plant(std::move(of_plant)) {}
};

/// Work of several hosts for one thread. The host goes first that is least in debt: what its
/// work has cost is a debt that time pays off. Pure.
class Turns {
  public:
    using Work = std::function<void()>;
    struct Turn {
        HostKey host;
        Work work;
    };

    /// Work of the empty key goes first.
    void add(const HostKey& host, Work work) { askers_[host].waiting.push_back(std::move(work)); }
    /// Returns nothing if no work waits but that of addresses on hold.
    std::optional<Turn> take();
    void charge(TimePoint now, const HostKey& host, Duration cost);
    /// Nothing of the address is taken until as many calls of release() have come.
    void hold(const HostKey& host) { ++askers_[host].holds; }
    void release(const HostKey& host) { --askers_[host].holds; }

  private:
    struct Asker {
        std::deque<Work> waiting{};
        TimePoint paid{};  ///< when its debt is paid
        unsigned holds = 0;
    };
    std::map<HostKey, Asker> askers_;
};

/// What crosses between the loops of a server, as messages: a request to the plant, its response
/// back, that a client has left, a deed for the audit. (Events cross by an EventOutlet, counters by
/// Server::counters().) The loops share nothing but immutable objects. The number of requests under
/// way is bounded by that of connections. A Crossing holds no timer, because the loop that ends
/// last ends it.
class Crossing : public std::enable_shared_from_this<Crossing> {
  public:
    using Handler = std::function<Handling(HttpRequest)>;

    explicit Crossing(Loops loops);

    const Loops& loops() const { return loops_; }
    bool is_one_loop() const { return loops_.faces == loops_.plant; }

    /// Faces: carries out the request on the plant's loop. The handler gets a caller of its own,
    /// which leaves when the session's leaves; then the response is empty. An exception of the
    /// handler is logged, and answered with 500. The plant begins one request at a time, and
    /// then serves its lines for nine times as long: however many ask, requests have a tenth of
    /// the plant's time. Addresses take turns by what their requests cost; a probe goes first.
    Handling ask(HttpRequest request, Handler handler, bool probe = false);
    /// Faces: makes the long text of a response in the worker, while the loop serves other clients.
    /// The response is empty if the caller leaves meanwhile. One text of an address is made at a
    /// time, and costs the address turns at the plant.
    Handling made_by_worker(HttpResponse response, std::function<void(HttpResponse&)> finish,
                            std::shared_ptr<Caller> caller, rt::Worker* worker);
    /// Faces: runs `work` on the plant's loop, perhaps before requests that wait for their turn.
    void tell(std::function<void()> work);
    /// Plant: runs `work` on the faces' loop; at once if there is one loop.
    void run(std::function<void()> work) const;
    /// Plant: the same, and returns when `work` has ended.
    void call(const std::function<void()>& work) const;
    /// Plant: the server is gone. All callers leave, and what comes later is dropped.
    void close();

    /// An object of the plant for the faces, by rt::lend().
    template <class Object>
    std::shared_ptr<const Object> lend(std::shared_ptr<const Object> object) const {
        return is_one_loop() ? object : rt::lend(loops_.plant, std::move(object));
    }

  private:
    struct Awaited;

    static Handling wait_for(std::shared_ptr<Awaited> awaited, std::shared_ptr<Caller> client);
    void begin(HttpRequest request, std::shared_ptr<const Handler> handler,
               std::weak_ptr<Awaited> waiting);
    void pass_next();
    void rest(const HostKey& host, Duration took);

    Loops loops_;
    // Of the faces' loop:
    Turns turns_;           ///< of requests that the plant has not begun
    bool passing_ = false;  ///< the plant begins one, or has its rest
    // Of the plant's loop:
    std::set<std::shared_ptr<Caller>> callers_;  ///< of the requests under way
    bool closed_ = false;
};

}  // namespace panelgate::web
