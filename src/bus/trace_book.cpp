#include "trace_book.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

namespace {

ByteView bytes_of(std::string_view text) {
    // NOLINTNEXTLINE(*-reinterpret-cast): characters are bytes
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Why it was sent, in one word.
std::string reason_of(const RecordedFrame& request) {
    if (request.kind != FrameKind::request) return std::string(label(request.kind));
    return std::string(label(request.why.priority));
}

}  // namespace

/// Uninitialised: pages are touched only when written, and only written bytes are read.
ByteRing::ByteRing(std::size_t size)
    : size_(size), bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(size)) {}

std::uint64_t ByteRing::add(ByteView bytes) {
    const std::uint64_t place = end_;
    bytes = bytes.first(std::min(bytes.size(), size_));
    while (!bytes.empty()) {
        const auto at = static_cast<std::size_t>(end_ % size_);
        const ByteView piece = bytes.first(std::min(bytes.size(), size_ - at));
        std::ranges::copy(piece, bytes_.get() + at);
        end_ += piece.size();
        bytes = bytes.subspan(piece.size());
    }
    return place;
}

Bytes ByteRing::at(std::uint64_t place, std::size_t length) const {
    Bytes bytes;
    bytes.reserve(length);
    while (bytes.size() < length) {
        const auto at = static_cast<std::size_t>((place + bytes.size()) % size_);
        const std::size_t piece = std::min(length - bytes.size(), size_ - at);
        bytes.insert(bytes.end(), bytes_.get() + at, bytes_.get() + at + piece);
    }
    return bytes;
}

TraceStore::TraceStore(const TraceSettings& settings)
    : limits_(settings),
      frames_(settings.frames),
      decisions_(settings.decisions),
      transactions_(settings.transactions),
      bytes_(settings.bytes),
      text_(settings.text) {}

std::size_t TraceStore::memory(const TraceSettings& settings) {
    return sizeof(TraceStore) + settings.frames * sizeof(RecordedFrame) +
           settings.decisions * sizeof(RecordedDecision) +
           settings.transactions * sizeof(RecordedTransaction) + settings.bytes + settings.text;
}

void TraceStore::add(RecordedFrame frame, ByteView bytes) {
    frame.size = static_cast<std::uint16_t>(
        std::min<std::size_t>({bytes.size(), bytes_.size(), std::size_t{UINT16_MAX}}));
    frame.place = bytes_.add(bytes.first(frame.size));
    frames_.add(std::move(frame));
    drop_incomplete();
}

void TraceStore::add(RecordedDecision decision, std::string_view text) {
    decision.size = std::min(text.size(), text_.size());
    decision.place = text_.add(bytes_of(text.substr(0, decision.size)));
    decisions_.add(decision);
    while (!decisions_.empty() && !text_.has(decisions_.at(0).place)) decisions_.drop_oldest();
}

void TraceStore::add(const RecordedTransaction& transaction) { transactions_.add(transaction); }

/// Drops a transaction with its request.
void TraceStore::drop_incomplete() {
    while (!frames_.empty() && !bytes_.has(frames_.at(0).place)) frames_.drop_oldest();
    const std::uint64_t oldest = frames_.empty() ? 0 : frames_.at(0).sequence;
    while (!transactions_.empty() && transactions_.at(0).first < oldest)
        transactions_.drop_oldest();
}

RecordedTransaction* TraceStore::newest() {
    return transactions_.empty() ? nullptr : &transactions_.at(transactions_.size() - 1);
}

RecordedTransaction* TraceStore::find(std::uint64_t id) {
    const RecordedTransaction* const last = newest();
    if (last == nullptr || id > last->id || last->id - id >= transactions_.size()) return nullptr;
    return &transactions_.at(transactions_.size() - 1 - static_cast<std::size_t>(last->id - id));
}

std::uint64_t TraceStore::first_of_last(std::size_t count) const {
    if (transactions_.empty()) return 0;
    const std::size_t size = transactions_.size();
    return transactions_.at(size - std::clamp<std::size_t>(count, 1, size)).first;
}

bool TraceStore::has_room() const {
    constexpr std::size_t kFrames = 4;
    constexpr std::size_t kBytes = 2 * modbus::kMaxRtuAdu;
    const std::size_t used = frames_.empty() ? 0 : bytes_.used_since(frames_.at(0).place);
    return frames_.size() + kFrames <= limits_.frames && used + kBytes <= limits_.bytes &&
           transactions_.size() < limits_.transactions;
}

void TraceStore::copy(const TraceStore& from, std::uint64_t since) {
    for (std::size_t i = 0; i < from.transactions_.size(); ++i) {
        const RecordedTransaction& one = from.transactions_.at(i);
        if (one.first > since) add(one);
    }
    for (std::size_t i = from.frames_.index_after(since); i < from.frames_.size(); ++i) {
        const RecordedFrame& one = from.frames_.at(i);
        add(one, from.bytes_.at(one.place, one.size));
    }
    for (std::size_t i = from.decisions_.index_after(since); i < from.decisions_.size(); ++i) {
        const TraceDecision one = from.decoded(from.decisions_.at(i));
        add(from.decisions_.at(i), one.text);
    }
}

void TraceStore::clear() {
    frames_.clear();
    decisions_.clear();
    transactions_.clear();
}

TraceFrame TraceStore::decoded(const RecordedFrame& frame) const {
    return {frame.sequence,
            frame.at,
            frame.kind,
            bytes_.at(frame.place, frame.size),
            text_of(frame.why, frame.client),
            frame.time,
            frame.transaction};
}

TraceDecision TraceStore::decoded(const RecordedDecision& decision) const {
    const Bytes text = text_.at(decision.place, decision.size);
    return {decision.sequence, decision.at, std::string(text.begin(), text.end()), decision.time};
}

TraceTransaction TraceStore::decoded(const RecordedTransaction& one) const {
    TraceTransaction made;
    static_cast<TransactionFacts&>(made) = one;
    for (std::size_t i = frames_.index_after(one.first - 1); i < frames_.size(); ++i) {
        const RecordedFrame& frame = frames_.at(i);
        if (frame.transaction != one.id) break;
        if (frame.sequence == one.first) {
            made.kind = frame.kind;
            made.reason = reason_of(frame);
            if (frame.client) made.client = *frame.client;
            made.request = bytes_.at(frame.place, frame.size);
        } else if (frame.kind == FrameKind::reply) {
            made.reply = bytes_.at(frame.place, frame.size);
        } else {
            made.discarded.push_back(decoded(frame));
        }
    }
    return made;
}

template <class Recorded>
auto TraceStore::decoded(const std::vector<Recorded>& recorded) const {
    std::vector<decltype(decoded(recorded.front()))> list;
    list.reserve(recorded.size());
    for (const Recorded& one : recorded) list.push_back(decoded(one));
    return list;
}

/// Only the newest may still be open.
std::size_t TraceStore::ended() const {
    const std::size_t size = transactions_.size();
    const bool open = size > 0 && transactions_.at(size - 1).sequence == RecordedTransaction::kOpen;
    return size - (open ? 1 : 0);
}

TracePart TraceStore::part(std::size_t last) const {
    const std::size_t open = transactions_.size() - ended();
    auto ended_last = transactions_.last(std::min(last, ended()) + open);
    if (open > 0) ended_last.pop_back();
    return {decoded(frames_.last(last)), decoded(decisions_.last(last)), decoded(ended_last)};
}

TracePart TraceStore::part_since(std::uint64_t sequence, std::size_t most) const {
    const std::size_t before = std::min(transactions_.index_after(sequence), ended());
    return {decoded(frames_.since(sequence, most)), decoded(decisions_.since(sequence, most)),
            decoded(transactions_.since(sequence, std::min(most, ended() - before)))};
}

void IncidentBook::on_error(const ErrorEvent& error, const TraceStore& trace) {
    if (settings_.incidents == 0) return;
    if (open_ && error.at > until_) close();
    if (!open_ && error.is_new) {
        open(error, trace);
    } else if (open_) {
        ++kept_.back()->head.errors;
    } else {
        return;
    }
    left_ = settings_.after;
    until_ = error.at + settings_.near;
}

void IncidentBook::open(const ErrorEvent& error, const TraceStore& trace) {
    Kept& kept = place();
    kept.head = {};
    kept.head.id = ++count_;
    kept.head.time = error.time;
    kept.head.station = error.station;
    kept.head.cause = error.cause;
    kept.head.errors = 1;
    kept.store.clear();
    const std::uint64_t first = trace.first_of_last(settings_.before + 1);
    kept.store.copy(trace, first == 0 ? 0 : first - 1);
    open_ = true;
}

/// Reuses the oldest incident already read, else the oldest.
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

namespace {

void log_frame(const std::string& line, const arbiter::Note& note, const ClientName& client) {
    if (!rt::log_enabled(rt::LogLevel::trace)) return;
    rt::log(rt::LogLevel::trace, "frame",
            {{"line", line},
             {"what", std::string(label(note.kind))},
             {"bytes", to_hex(note.bytes)},
             {"why", text_of(note.why, client)}});
}

bool begins(FrameKind kind) {
    return direction_of(kind) == FrameDirection::sent || kind == FrameKind::heard_request;
}

}  // namespace

TraceBook::TraceBook(const Settings& settings, Wall& wall)
    : settings_(settings), wall_(wall), store_(settings.trace), incidents_(settings.incidents) {}

void TraceBook::clear() {
    store_ = TraceStore(settings_.trace);
    incidents_ = IncidentBook(settings_.incidents);
}

void TraceBook::note(arbiter::Note note, ClientName client) {
    log_frame(settings_.name, note, client);
    RecordedFrame frame;
    frame.sequence = ++sequence_;
    frame.at = note.at;
    frame.time = wall_.at(note.at);
    if (begins(note.kind)) begin(note, frame);
    frame.transaction = current_;
    frame.kind = note.kind;
    frame.why = note.why;
    frame.client = std::move(client);
    const WallTime time = frame.time;
    incidents_.add(frame, note.bytes);
    store_.add(std::move(frame), note.bytes);
    if (note.kind != FrameKind::late || note.bytes.empty()) return;
    if (is_unlisted(note.bytes.front())) return;
    incidents_.on_error({note.at, time, note.bytes.front(), "late"}, store_);
}

void TraceBook::begin(const arbiter::Note& note, const RecordedFrame& request) {
    current_ = note.transaction == 0 ? current_ + 1 : note.transaction;
    RecordedTransaction begun;
    begun.id = current_;
    begun.first = request.sequence;
    begun.time = request.time;
    begun.granted = begun.first_bit_out = begun.last_bit_out = note.at;
    if (!note.bytes.empty()) begun.station = note.bytes.front();
    incidents_.begin(begun);
    store_.add(begun);
}

void TraceBook::decide(TimePoint at, const std::string& text) {
    if (rt::log_enabled(rt::LogLevel::trace))
        rt::log(rt::LogLevel::trace, "decision", {{"line", settings_.name}, {"why", text}});
    const RecordedDecision decision{++sequence_, at, wall_.at(at)};
    incidents_.add(decision, text);
    store_.add(decision, text);
}

void TraceBook::end(const arbiter::Exchange& exchange) {
    const auto id = exchange.transaction == 0 ? current_ : exchange.transaction;
    RecordedTransaction* const found = store_.find(id);
    if (found == nullptr) return;
    found->sequence = ++sequence_;
    found->end = exchange.end;
    found->station = exchange.station;
    found->time = wall_.at(exchange.first_bit_out);
    static_cast<TransactionInstants&>(*found) = exchange;
    incidents_.end(*found);
    judge(*found, exchange.last_bit_out);
}

/// A transaction that ends like the station's previous one opens no incident. on_line_down()
/// handles the loss of a line.
void TraceBook::judge(const RecordedTransaction& transaction, TimePoint at) {
    const TransactionEnd before = std::exchange(ends_[transaction.station], transaction.end);
    if (!is_error(transaction.end) || transaction.end == TransactionEnd::line_down) return;
    if (transaction.end == TransactionEnd::timeout && is_unlisted(transaction.station)) return;
    incidents_.on_error({at, transaction.time, transaction.station, label(transaction.end),
                         before != transaction.end},
                        store_);
}

/// An unlisted station's timeouts, and its late replies, are expected.
bool TraceBook::is_unlisted(std::uint8_t station) const {
    return station != 0 && !settings_.stations.contains(station);
}

void TraceBook::answered(arbiter::Transaction transaction, TimePoint at) {
    RecordedTransaction* const found = store_.find(transaction);
    if (found == nullptr || found->answered) return;
    found->answered = at;
    incidents_.update(*found);
}

void TraceBook::on_line_down(TimePoint at) {
    if (store_.empty()) return;
    incidents_.on_error({at, wall_.at(at), std::nullopt, "line_down"}, store_);
}

}  // namespace panelgate::bus
