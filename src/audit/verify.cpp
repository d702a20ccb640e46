#include "panelgate/audit/verify.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace panelgate::audit {

std::string_view label(Fault::Kind kind) {
    switch (kind) {
        case Fault::Kind::changed:
            return "changed";
        case Fault::Kind::removed:
            return "removed";
        case Fault::Kind::added:
            return "added";
        case Fault::Kind::reordered:
            return "reordered";
        case Fault::Kind::torn:
            return "torn";
        case Fault::Kind::anchor:
            return "anchor";
    }
    std::abort();
}

namespace {

std::string record_text(std::uint64_t number) { return "record " + std::to_string(number); }

/// "records 5 to 7", or "record 5".
std::string records_text(std::uint64_t first, std::uint64_t last) {
    if (first == last) return record_text(first);
    return "records " + std::to_string(first) + " to " + std::to_string(last);
}

/// What stands behind `key` in a log line: its digits (of base 16 for a hash).
std::string_view digits_behind(std::string_view line, std::string_view key, bool hex) {
    const auto at = line.find(key);
    if (at == line.npos) return {};
    std::string_view rest = line.substr(at + key.size());
    rest.remove_prefix(std::min(rest.find_first_not_of("\"=: "), rest.size()));
    const auto end = rest.find_first_not_of(hex ? "0123456789abcdef" : "0123456789");
    return rest.substr(0, end);
}

}  // namespace

void collect_anchor(std::string_view log_line, Anchors& anchors) {
    constexpr std::string_view kEvent = "audit anchor";
    constexpr std::size_t kShortest = 16;
    const auto at = log_line.find(kEvent);
    if (at == log_line.npos) return;
    const std::string_view rest = log_line.substr(at + kEvent.size());
    const std::string_view number = digits_behind(rest, "number", false);
    const std::string_view hash = digits_behind(rest, "hash", true);
    std::uint64_t value = 0;
    const auto [end, wrong] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (wrong != std::errc{} || value == 0 || hash.size() < kShortest || hash.size() > 64) return;
    anchors[value] = hash;
}

void Verifier::begin_file(std::string name) {
    file_ = std::move(name);
    line_ = 0;
}

Fault Verifier::fault_here(Fault::Kind kind, std::uint64_t number, std::string text) const {
    return {kind, number, file_, line_, std::move(text)};
}

void Verifier::decide(Fault::Kind kind, std::string text) {
    report_.fault = std::move(suspect_->fault);
    report_.fault->kind = kind;
    report_.fault->text = std::move(text);
    suspect_.reset();
    decided_ = true;
}

void Verifier::suspect(Fault::Kind kind, const Sealed* record) {
    const std::uint64_t expected = report_.last.number + 1;
    suspect_ = Suspect{fault_here(kind, expected, {})};
    if (record == nullptr) return;
    suspect_->found = record->number;
    suspect_->claimed = record->hash;
}

bool Verifier::take(std::string_view line, bool whole) {
    if (decided_) return false;
    ++line_;
    const auto record = whole ? parse_line(line) : std::nullopt;
    if (suspect_) {
        if (record) look_on(*record);
        return !decided_;
    }
    if (!whole) {
        suspect(Fault::Kind::torn, nullptr);
        decide(Fault::Kind::torn,
               "the last line is not whole: the gateway was killed while it "
               "was written, or the end was cut off");
    } else if (!record) {
        suspect(Fault::Kind::changed, nullptr);
    } else if (report_.records == 0) {
        begin_chain(*record);
    } else {
        judge(*record);
    }
    return !decided_;
}

/// The oldest file names what it follows; older ones may have been dropped by rotation.
void Verifier::begin_chain(const Sealed& record) {
    report_.first = record.number;
    if (record.number == 1) return judge(record);
    const auto previous = previous_in(record);
    report_.last.number = record.number - 1;
    if (previous) {
        report_.last.hash = *previous;
        return judge(record);
    }
    suspect(Fault::Kind::removed, &record);
    decide(Fault::Kind::removed, "the files begin with " + record_text(record.number) +
                                     ", which does not begin a file: what stood before it was "
                                     "removed");
}

void Verifier::judge(const Sealed& record) {
    const std::uint64_t expected = report_.last.number + 1;
    if (record.number > expected) return suspect(Fault::Kind::removed, &record);
    if (record.number < expected) {
        suspect(Fault::Kind::added, &record);
        suspect_->fault.number = record.number;
        return decide(Fault::Kind::added, record_text(record.number) + " stands again behind " +
                                              record_text(report_.last.number));
    }
    if (digest_.of(text_of(report_.last.hash), record.text) != record.hash)
        return suspect(Fault::Kind::changed, &record);
    accept(record);
}

void Verifier::accept(const Sealed& record) {
    report_.last = {record.number, record.hash};
    ++report_.records;
    remark(record);
    const auto anchor = anchors_.find(record.number);
    if (anchor == anchors_.end()) return;
    if (text_of(record.hash).starts_with(anchor->second)) {
        ++report_.anchored;
        return;
    }
    report_.fault = fault_here(Fault::Kind::anchor, record.number,
                               record_text(record.number) +
                                   " is another one than the log names: the chain was made anew, "
                                   "from there or from an earlier record on");
    decided_ = true;
}

void Verifier::look_on(const Sealed& record) {
    ++suspect_->followed;
    if (suspect_->fault.kind == Fault::Kind::removed) {
        look_on_after_jump(record);
    } else {
        look_on_after_change(record);
    }
}

/// A record, or a line that is none, did not fit. One more record tells what it was.
void Verifier::look_on_after_change(const Sealed& record) {
    const std::uint64_t number = suspect_->fault.number;
    if (record.number == number &&
        digest_.of(text_of(report_.last.hash), record.text) == record.hash)
        return decide(Fault::Kind::added, "a line was added before " + record_text(number));
    if (suspect_->found == 0)
        return decide(Fault::Kind::changed, record_text(number) + " is no record any more");
    const bool hash_is_right = record.number == number + 1 &&
                               digest_.of(text_of(suspect_->claimed), record.text) == record.hash;
    std::string text = record_text(number) + " was changed";
    if (number > 1 && hash_is_right)
        text += " (or " + record_text(number - 1) + " together with its hash)";
    decide(Fault::Kind::changed, std::move(text));
}

/// A higher number than expected stands here: was something removed, or does it stand elsewhere?
void Verifier::look_on_after_jump(const Sealed& record) {
    const std::uint64_t expected = suspect_->fault.number;
    if (record.number == expected) {
        suspect_->seen_expected = true;
        suspect_->next_is_expected = suspect_->followed == 1;
    }
    if (record.number != suspect_->found) return;
    if (!suspect_->next_is_expected) return;
    suspect_->fault.number = suspect_->found;
    const std::string found = record_text(suspect_->found);
    decide(Fault::Kind::added, "a copy of " + found + " was added before " + record_text(expected));
}

void Verifier::decide_at_end() {
    const std::uint64_t expected = suspect_->fault.number;
    if (suspect_->fault.kind == Fault::Kind::changed) {
        const bool is_record = suspect_->found != 0;
        return decide(Fault::Kind::changed,
                      record_text(expected) + (is_record ? " was changed" : " is no record"));
    }
    const std::uint64_t found = suspect_->found;
    if (!suspect_->seen_expected)
        return decide(Fault::Kind::removed,
                      records_text(expected, found - 1) + " removed before " + record_text(found));
    if (suspect_->next_is_expected) suspect_->fault.number = found;
    decide(Fault::Kind::reordered,
           record_text(found) + " stands where " + record_text(expected) + " belongs");
}

/// What the records themselves say is missing.
void Verifier::remark(const Sealed& record) {
    const std::string_view kind = member_of(record.body, "kind");
    if ((kind != "lost" && kind != "start") || report_.remarks.size() >= kRemarks) return;
    const std::string when =
        record_text(record.number) + " (" + std::string(member_of(record.body, "time")) + "): ";
    if (kind == "lost")
        report_.remarks.push_back(when + std::string(member_of(record.body, "count")) +
                                  " records were left out, the disk took nothing");
    if (member_of(record.body, "unclean") == "true")
        report_.remarks.push_back(when +
                                  "the run before did not end in order; what it did in its "
                                  "last second may be missing");
    const std::string_view torn = member_of(record.body, "torn_bytes");
    if (!torn.empty())
        report_.remarks.push_back(when + "a torn line of " + std::string(torn) +
                                  " bytes was found and taken over into this record");
}

void Verifier::check_end() {
    if (anchors_.empty() || anchors_.rbegin()->first <= report_.last.number) return;
    const std::uint64_t named = anchors_.rbegin()->first;
    report_.fault = Fault{Fault::Kind::removed, report_.last.number + 1, file_, 0,
                          "the log names " + record_text(named) + ", but the files end with " +
                              record_text(report_.last.number) + ": " +
                              records_text(report_.last.number + 1, named) + " removed at the end"};
}

Report Verifier::finish() {
    if (suspect_) decide_at_end();
    if (!report_.fault) check_end();
    return std::move(report_);
}

std::vector<std::string> in_order(std::vector<std::string> files,
                                  const std::function<std::string(const std::string&)>& head_of) {
    std::vector<std::pair<std::uint64_t, std::string>> heads;
    for (std::string& file : files) {
        const std::string head = head_of(file);
        const auto record = parse_line(head);
        heads.emplace_back(record ? record->number : 0, std::move(file));
    }
    std::ranges::sort(heads);
    std::vector<std::string> sorted;
    for (auto& [number, file] : heads) sorted.push_back(std::move(file));
    return sorted;
}

}  // namespace panelgate::audit
