#include "panelgate/gateway/scrapes.hpp"

#include <algorithm>
#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <cstddef>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/network.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/metrics/process.hpp"
#include "panelgate/tls/stream.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::gateway {

/// One text. Owned by the loop, then by the worker, then by the loop again, except for `given_up`.
struct Scrapes::Job {
    metrics::Snapshot snapshot;
    bool plain = false;  ///< wanted uncompressed
    bool gzip = false;
    std::size_t expected_size = 0;
    std::atomic<bool> given_up = false;  ///< no caller waits any more
    web::SharedText text;
    web::SharedText packed;

    void write();
};

/// Runs in the worker and frees the figures. Without memory there is no text.
void Scrapes::Job::write() try {
    snapshot.process = metrics::read_process_facts();
    std::string made;
    if (plain) made.reserve(expected_size);
    std::optional<web::Gzip> packing;
    if (gzip) packing.emplace();
    metrics::exposition(snapshot, [&](std::string_view piece) {
        if (plain) made += piece;
        if (packing) packing->add(piece);
        return !given_up;
    });
    snapshot = {};
    if (given_up) return;
    if (plain) text = std::make_shared<const std::string>(std::move(made));
    if (packing) packed = std::make_shared<const std::string>(packing->finish());
} catch (const std::exception&) {
    text = nullptr;
    packed = nullptr;
}

Scrapes::Scrapes(boost::asio::any_io_executor executor, std::function<Copy()> begin,
                 Settings settings)
    : executor_(executor),
      begin_(std::move(begin)),
      settings_(settings),
      worker_(std::move(executor)) {}

Scrapes::~Scrapes() {
    if (job_) job_->given_up = true;
}

void Scrapes::scrape(std::uint64_t caller, bool gzip, Handler handler) {
    if (waiting_.size() >= settings_.waiting || sending_bytes() > settings_.sending_bytes)
        return hand_over(std::move(handler), nullptr);
    waiting_.push_back({caller, gzip, std::move(handler)});
    if (!job_) begin();
}

void Scrapes::cancel(std::uint64_t caller) {
    drop(waiting_, caller);
    drop(served_, caller);
    if (job_ && served_.empty()) job_->given_up = true;
}

void Scrapes::drop(std::vector<Waiter>& waiters, std::uint64_t caller) {
    const auto found = std::ranges::find(waiters, caller, &Waiter::caller);
    if (found == waiters.end()) return;
    Handler handler = std::move(found->handler);
    waiters.erase(found);
    hand_over(std::move(handler), nullptr);
}

void Scrapes::begin() {
    served_ = std::exchange(waiting_, {});
    job_ = std::make_shared<Job>();
    for (const Waiter& waiter : served_) (waiter.gzip ? job_->gzip : job_->plain) = true;
    job_->expected_size = last_size_;
    copy_ = begin_();
    step();
}

/// Copies one piece of the figures per turn of the loop.
void Scrapes::step() {
    boost::asio::post(executor_, [self = std::weak_ptr(self_)] {
        const auto alive = self.lock();
        if (!alive) return;
        Scrapes& scrapes = **alive;
        if (scrapes.job_->given_up) return scrapes.end();
        if (scrapes.copy_(scrapes.job_->snapshot)) return scrapes.step();
        scrapes.write();
    });
}

void Scrapes::write() {
    worker_.run([job = job_] { job->write(); },
                [self = std::weak_ptr(self_)] {
                    if (const auto alive = self.lock()) (*alive)->end();
                });
}

void Scrapes::end() {
    copy_ = nullptr;
    const std::shared_ptr<Job> job = std::exchange(job_, nullptr);
    if (job->text) last_size_ = job->text->size();
    for (const web::SharedText& made : {job->text, job->packed}) {
        if (made) sent_.push_back(made);
    }
    for (Waiter& waiter : std::exchange(served_, {}))
        hand_over(std::move(waiter.handler), waiter.gzip ? job->packed : job->text);
    if (!waiting_.empty()) begin();
}

void Scrapes::hand_over(Handler handler, web::SharedText text) {
    boost::asio::post(executor_, [handler = std::move(handler), text = std::move(text)]() mutable {
        handler(std::move(text));
    });
}

/// The bytes of all texts that are still being sent.
std::size_t Scrapes::sending_bytes() {
    std::erase_if(sent_, [](const auto& text) { return text.expired(); });
    std::size_t bytes = 0;
    for (const auto& weak : sent_) {
        if (const auto text = weak.lock()) bytes += text->size();
    }
    return bytes;
}

}  // namespace panelgate::gateway
