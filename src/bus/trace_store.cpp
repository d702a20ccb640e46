#include "trace_store.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::bus {
namespace {

ByteView bytes_of(std::string_view text) {
    // NOLINTNEXTLINE(*-reinterpret-cast): characters are bytes
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// What it was sent for, in a word.
std::string reason_of(const RecordedFrame& request) {
    if (request.kind != FrameKind::request) return std::string(label(request.kind));
    return std::string(label(request.why.priority));
}

}  // namespace

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
    forget_torn();
}

void TraceStore::add(RecordedDecision decision, std::string_view text) {
    decision.size = std::min(text.size(), text_.size());
    decision.place = text_.add(bytes_of(text.substr(0, decision.size)));
    decisions_.add(decision);
    while (!decisions_.empty() && !text_.has(decisions_.at(0).place)) decisions_.drop_oldest();
}

void TraceStore::add(const RecordedTransaction& transaction) { transactions_.add(transaction); }

/// A transaction whose request is gone goes with it.
void TraceStore::forget_torn() {
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
    for (std::size_t i = from.frames_.place_behind(since); i < from.frames_.size(); ++i) {
        const RecordedFrame& one = from.frames_.at(i);
        add(one, from.bytes_.at(one.place, one.size));
    }
    for (std::size_t i = from.decisions_.place_behind(since); i < from.decisions_.size(); ++i) {
        const TraceDecision one = from.told(from.decisions_.at(i));
        add(from.decisions_.at(i), one.text);
    }
}

void TraceStore::clear() {
    frames_.clear();
    decisions_.clear();
    transactions_.clear();
}

TraceFrame TraceStore::told(const RecordedFrame& frame) const {
    return {frame.sequence,     frame.at,   frame.kind,       bytes_.at(frame.place, frame.size),
            text_of(frame.why), frame.time, frame.transaction};
}

TraceDecision TraceStore::told(const RecordedDecision& decision) const {
    const Bytes text = text_.at(decision.place, decision.size);
    return {decision.sequence, decision.at, std::string(text.begin(), text.end()), decision.time};
}

TraceTransaction TraceStore::told(const RecordedTransaction& one) const {
    TraceTransaction made;
    static_cast<TransactionFacts&>(made) = one;
    for (std::size_t i = frames_.place_behind(one.first - 1); i < frames_.size(); ++i) {
        const RecordedFrame& frame = frames_.at(i);
        if (frame.transaction != one.id) break;
        if (frame.sequence == one.first) {
            made.kind = frame.kind;
            made.reason = reason_of(frame);
            if (frame.why.client) made.client = *frame.why.client;
            made.request = bytes_.at(frame.place, frame.size);
        } else if (frame.kind == FrameKind::reply) {
            made.reply = bytes_.at(frame.place, frame.size);
        } else {
            made.discarded.push_back(told(frame));
        }
    }
    return made;
}

template <class Told, class Recorded>
std::vector<Told> TraceStore::in_words(const std::vector<Recorded>& recorded) const {
    std::vector<Told> words;
    words.reserve(recorded.size());
    for (const Recorded& one : recorded) words.push_back(told(one));
    return words;
}

std::vector<TraceFrame> TraceStore::frames(std::size_t last) const {
    return in_words<TraceFrame>(frames_.last(last));
}

std::vector<TraceFrame> TraceStore::frames_since(std::uint64_t sequence, std::size_t most) const {
    return in_words<TraceFrame>(frames_.since(sequence, most));
}

std::vector<TraceDecision> TraceStore::decisions(std::size_t last) const {
    return in_words<TraceDecision>(decisions_.last(last));
}

std::vector<TraceDecision> TraceStore::decisions_since(std::uint64_t sequence,
                                                       std::size_t most) const {
    return in_words<TraceDecision>(decisions_.since(sequence, most));
}

/// Only the newest may still be open.
std::size_t TraceStore::ended() const {
    const std::size_t size = transactions_.size();
    const bool open = size > 0 && transactions_.at(size - 1).sequence == RecordedTransaction::kOpen;
    return size - (open ? 1 : 0);
}

std::vector<TraceTransaction> TraceStore::transactions(std::size_t last) const {
    const std::size_t open = transactions_.size() - ended();
    auto some = transactions_.last(std::min(last, ended()) + open);
    if (open > 0) some.pop_back();
    return in_words<TraceTransaction>(some);
}

std::vector<TraceTransaction> TraceStore::transactions_since(std::uint64_t sequence,
                                                             std::size_t most) const {
    const std::size_t before = std::min(transactions_.place_behind(sequence), ended());
    return in_words<TraceTransaction>(
        transactions_.since(sequence, std::min(most, ended() - before)));
}

TracePart TraceStore::part(std::size_t last) const {
    return {frames(last), decisions(last), transactions(last)};
}

TracePart TraceStore::part_since(std::uint64_t sequence, std::size_t most) const {
    return {frames_since(sequence, most), decisions_since(sequence, most),
            transactions_since(sequence, most)};
}

}  // namespace panelgate::bus
