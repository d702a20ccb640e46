#include "panelgate/audit/verify.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "panelgate/base/text.hpp"

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

/// The fields of a line of the log, behind its event.
class Fields {
  public:
    Fields(std::string_view rest, bool json) : rest_(rest), json_(json) {}

    /// Takes the next field, which must be this one.
    std::optional<std::string_view> take(std::string_view key) {
        const std::string begin =
            json_ ? ",\"" + std::string(key) + "\":\"" : ' ' + std::string(key) + '=';
        if (!rest_.starts_with(begin)) return std::nullopt;
        rest_.remove_prefix(begin.size());
        const auto end = std::min(rest_.find_first_of(json_ ? "\"" : " \r\"\\"), rest_.size());
        const std::string_view value = rest_.substr(0, end);
        rest_.remove_prefix(json_ ? std::min(end + 1, rest_.size()) : end);
        return value;
    }

  private:
    std::string_view rest_;
    bool json_;
};

/// What panelgate itself has written: a value with a blank stands in quotes, and no value has a
/// bare quote, so the event stands before the first one; in JSON `,"` begins a member.
std::optional<Fields> fields_of(std::string_view line, std::string_view level,
                                std::string_view event) {
    constexpr std::string_view kMessage = "\"MESSAGE\":\"";  // journalctl -o json
    const std::string member = ",\"event\":\"" + std::string(event) + '"';
    if (const auto at = line.find(member); at != line.npos)
        return Fields(line.substr(at + member.size()), true);
    const auto message = line.find(kMessage);
    if (message != line.npos && message > 0 &&
        (line[message - 1] == '{' || line[message - 1] == ','))
        line.remove_prefix(message + kMessage.size());
    const std::string words = std::string(level) + ' ' + std::string(event) + ' ';
    const auto at = line.find(words);
    if (at == line.npos || line.find('"') < at) return std::nullopt;
    if (at > 0 && line[at - 1] != ' ' && line[at - 1] != '>') return std::nullopt;
    return Fields(line.substr(at + words.size() - 1), false);
}

std::optional<std::uint64_t> number_of(std::optional<std::string_view> text) {
    if (!text) return std::nullopt;
    const auto value = to_number<std::uint64_t>(*text);
    return value && *value > 0 ? value : std::nullopt;
}

bool is_hex(std::string_view text) {
    return text.find_first_not_of("0123456789abcdef") == text.npos;
}

}  // namespace

void collect_anchor(std::string_view log_line, Anchors& anchors) {
    constexpr std::size_t kShortest = 16;
    if (auto fields = fields_of(log_line, "error", "audit records lost"))
        anchors.lost += number_of(fields->take("count")).value_or(0);
    auto fields = fields_of(log_line, "info", "audit anchor");
    if (!fields) return;
    const auto number = number_of(fields->take("number"));
    const std::string_view hash = fields->take("hash").value_or("");
    const std::string_view chain = fields->take("chain").value_or("");
    if (!number || hash.size() < kShortest || hash.size() > 64) return;
    if (!is_hex(hash) || !is_hex(chain)) return;
    anchors.chains[std::string(chain)][*number] = hash;
    if (const auto file = fields->take("file")) anchors.files[std::string(chain)] = *file;
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
    if (member_of(record.body, "kind") == "file") look_at_file(record);
    remark(record);
    if (!report_.fault) compare(record);
}

/// Each file names its chain, and from which record on files are kept.
void Verifier::look_at_file(const Sealed& record) {
    std::string_view chain = member_of(record.body, "chain");
    if (!is_hex(chain)) chain = {};
    if (has_chain_ && chain != report_.chain) {
        report_.fault = fault_here(Fault::Kind::changed, record.number,
                                   record_text(record.number) + " begins a file of another chain");
        decided_ = true;
        return;
    }
    report_.chain = chain;
    has_chain_ = true;
    kept_from_ = number_of(member_of(record.body, "from")).value_or(0);
}

void Verifier::compare(const Sealed& record) {
    const auto named = anchors_.chains.find(report_.chain);
    if (named == anchors_.chains.end()) return;
    const auto anchor = named->second.find(record.number);
    if (anchor == named->second.end()) return;
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

void Verifier::note(std::string text) {
    if (report_.remarks.size() < kRemarks) report_.remarks.push_back(std::move(text));
}

/// What the records themselves say is missing.
void Verifier::remark(const Sealed& record) {
    const std::string_view kind = member_of(record.body, "kind");
    if (kind != "lost" && kind != "start" && kind != "file") return;
    const std::string when =
        record_text(record.number) + " (" + std::string(member_of(record.body, "time")) + "): ";
    const std::string_view gone = member_of(record.body, "gone");
    if (number_of(gone))
        note(when +
             "the file before was removed, or changed by others, while it was written, with the "
             "records from " +
             std::string(gone) + " on");
    if (kind == "lost")
        note(when + std::string(member_of(record.body, "count")) +
             " records were left out, the disk took nothing");
    if (member_of(record.body, "unclean") == "true")
        note(when +
             "the run before did not end in order; what it did in its last second, or since its "
             "log says `audit fails`, may be missing");
    if (const std::string_view said = member_of(record.body, "remark"); !said.empty())
        note(when + std::string(said));
    const std::string_view torn = member_of(record.body, "torn_bytes");
    if (!torn.empty())
        note(when + "a torn line of " + std::string(torn) +
             " bytes was found and taken over into this record");
}

/// Files that the chain itself says are kept must be there.
void Verifier::check_begin() {
    if (report_.records == 0 || kept_from_ == 0 || report_.first <= kept_from_) return;
    const std::string missing = records_text(kept_from_, report_.first - 1);
    if (all_of_.empty())
        return note("these files begin with " + record_text(report_.first) + "; " + missing +
                    " stand in other files of this audit");
    report_.fault =
        Fault{Fault::Kind::removed, kept_from_, file_, 0,
              missing + " removed: the files begin with " + record_text(report_.first) +
                  ", and rotation has dropped only what stood before " + record_text(kept_from_)};
}

void Verifier::check_end() {
    const auto named_here = anchors_.chains.find(report_.chain);
    if (named_here == anchors_.chains.end()) return;
    const std::uint64_t named = named_here->second.rbegin()->first;
    if (named <= report_.last.number) return;
    report_.fault = Fault{Fault::Kind::removed, report_.last.number + 1, file_, 0,
                          "the log names " + record_text(named) + ", but the files end with " +
                              record_text(report_.last.number) + ": " +
                              records_text(report_.last.number + 1, named) + " removed at the end"};
}

/// A log that names nothing of these files proves nothing.
void Verifier::check_anchors() {
    if (!anchors_.is_read || report_.records == 0 || report_.anchored > 0) return;
    const std::string chain = report_.chain.empty() ? "this chain" : "the chain " + report_.chain;
    report_.fault =
        Fault{Fault::Kind::anchor, report_.last.number, file_, 0,
              "the log names no record of " + chain +
                  " in these files, so nothing was compared: it is another log, or the chain was "
                  "made anew"};
}

void Verifier::tell_of_log() {
    if (anchors_.lost > 0)
        note("the log says that " + std::to_string(anchors_.lost) +
             " records could not be written when a run ended");
    for (const auto& [chain, named] : anchors_.chains) {
        if (chain == report_.chain || named.empty()) continue;
        check_other_chain(chain, named.rbegin()->first);
    }
}

/// What was written to the same file is no other audit: its files were removed, or moved away.
void Verifier::check_other_chain(const std::string& chain, std::uint64_t last) {
    const std::string named = "the log names records of another chain too, " +
                              (chain.empty() ? "without id" : chain) + ", up to " +
                              record_text(last);
    const auto file = anchors_.files.find(chain);
    const bool was_here = file != anchors_.files.end() && file->second == all_of_;
    if (!was_here) return note(named + ": of another audit, or of one that was removed");
    if (report_.fault) return note(named + ", which were written to this file");
    report_.fault = Fault{Fault::Kind::removed, last, all_of_, 0,
                          named + ", which were written to this file and are not there"};
}

Report Verifier::finish() {
    if (suspect_) decide_at_end();
    if (!report_.fault) check_begin();
    if (!report_.fault) check_end();
    if (!report_.fault) check_anchors();
    tell_of_log();
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
