#include "incident_book.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace panelgate::bus {

void IncidentBook::on_trouble(const Trouble& trouble, const TraceStore& trace) {
    if (settings_.incidents == 0) return;
    if (open_ && trouble.at > until_) close();
    if (!open_ && trouble.news) {
        open(trouble, trace);
    } else if (open_) {
        ++kept_.back()->head.errors;
    } else {
        return;
    }
    left_ = settings_.after;
    until_ = trouble.at + settings_.near;
}

void IncidentBook::open(const Trouble& trouble, const TraceStore& trace) {
    Kept& kept = place();
    kept.head = {};
    kept.head.id = ++count_;
    kept.head.time = trouble.time;
    kept.head.station = trouble.station;
    kept.head.cause = trouble.cause;
    kept.head.errors = 1;
    kept.store.clear();
    const std::uint64_t first = trace.first_of_last(settings_.before + 1);
    kept.store.copy(trace, first == 0 ? 0 : first - 1);
    open_ = true;
}

/// What somebody has read gives way first, then the oldest.
IncidentBook::Kept& IncidentBook::place() {
    if (kept_.size() < settings_.incidents) {
        kept_.push_back(std::make_unique<Kept>(IncidentHead{}, TraceStore(settings_.each)));
    } else {
        auto victim = std::ranges::find_if(kept_, [](const auto& kept) { return kept->head.read; });
        if (victim == kept_.end()) victim = kept_.begin();
        std::rotate(victim, victim + 1, kept_.end());
    }
    return *kept_.back();
}

void IncidentBook::close() {
    kept_.back()->head.complete = true;
    open_ = false;
}

void IncidentBook::begin(const RecordedTransaction& transaction) {
    if (!open_) return;
    TraceStore& store = kept_.back()->store;
    if (left_ == 0 || transaction.granted > until_ || !store.has_room()) return close();
    store.add(transaction);
}

void IncidentBook::add(const RecordedFrame& frame, ByteView bytes) {
    if (open_) kept_.back()->store.add(frame, bytes);
}

void IncidentBook::add(const RecordedDecision& decision, std::string_view text) {
    if (open_) kept_.back()->store.add(decision, text);
}

void IncidentBook::update(const RecordedTransaction& transaction) {
    if (!open_) return;
    if (RecordedTransaction* own = kept_.back()->store.find(transaction.id)) *own = transaction;
}

void IncidentBook::end(const RecordedTransaction& transaction) {
    update(transaction);
    if (open_ && left_ > 0) --left_;
}

std::vector<IncidentHead> IncidentBook::heads() const {
    std::vector<IncidentHead> heads;
    for (const auto& kept : kept_) heads.push_back(kept->head);
    return heads;
}

std::optional<Incident> IncidentBook::fetch(std::uint64_t id) {
    for (const auto& kept : kept_) {
        if (kept->head.id != id) continue;
        kept->head.read = true;
        return Incident{kept->head, kept->store.part(SIZE_MAX)};
    }
    return std::nullopt;
}

}  // namespace panelgate::bus
