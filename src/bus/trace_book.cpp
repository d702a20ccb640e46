#include "trace_book.hpp"

#include <utility>

#include "panelgate/rt/log.hpp"

namespace panelgate::bus {
namespace {

void log_frame(const std::string& line, const arbiter::Note& note) {
    if (!rt::log_enabled(rt::LogLevel::trace)) return;
    rt::log(rt::LogLevel::trace, "frame",
            {{"line", line},
             {"what", std::string(label(note.kind))},
             {"bytes", to_hex(note.bytes)},
             {"why", text_of(note.why)}});
}

bool begins(FrameKind kind) {
    return direction_of(kind) == FrameDirection::sent || kind == FrameKind::heard_request;
}

}  // namespace

TraceBook::TraceBook(const Settings& settings, Wall& wall)
    : settings_(settings), wall_(wall), store_(settings.trace), incidents_(settings.incidents) {}

void TraceBook::note(arbiter::Note note) {
    log_frame(settings_.name, note);
    RecordedFrame frame;
    frame.sequence = ++happened_;
    frame.at = note.at;
    frame.time = wall_.at(note.at);
    if (begins(note.kind)) begin(note, frame);
    frame.transaction = current_;
    frame.kind = note.kind;
    frame.why = std::move(note.why);
    const WallTime time = frame.time;
    incidents_.add(frame, note.bytes);
    store_.add(std::move(frame), note.bytes);
    if (note.kind != FrameKind::late || note.bytes.empty()) return;
    if (is_stranger(note.bytes.front())) return;
    incidents_.on_trouble({note.at, time, note.bytes.front(), "late"}, store_);
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
    const RecordedDecision decision{++happened_, at, wall_.at(at)};
    incidents_.add(decision, text);
    store_.add(decision, text);
}

void TraceBook::end(const arbiter::Exchange& exchange) {
    const auto id = exchange.transaction == 0 ? current_ : exchange.transaction;
    RecordedTransaction* const found = store_.find(id);
    if (found == nullptr) return;
    found->sequence = ++happened_;
    found->end = exchange.end;
    found->station = exchange.station;
    found->time = wall_.at(exchange.first_bit_out);
    static_cast<TransactionInstants&>(*found) = exchange;
    incidents_.end(*found);
    judge(*found, exchange.last_bit_out);
}

/// What ends as the one before to the same station did is no news. The loss of a line is told by
/// itself.
void TraceBook::judge(const RecordedTransaction& transaction, TimePoint at) {
    const TransactionEnd before = std::exchange(ends_[transaction.station], transaction.end);
    if (!is_error(transaction.end) || transaction.end == TransactionEnd::line_down) return;
    if (transaction.end == TransactionEnd::timeout && is_stranger(transaction.station)) return;
    incidents_.on_trouble({at, transaction.time, transaction.station, label(transaction.end),
                           before != transaction.end},
                          store_);
}

/// Nobody has listed it: its silence, and a reply behind the short wait for it, are expected.
bool TraceBook::is_stranger(std::uint8_t station) const {
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
    incidents_.on_trouble({at, wall_.at(at), std::nullopt, "line_down"}, store_);
}

}  // namespace panelgate::bus
