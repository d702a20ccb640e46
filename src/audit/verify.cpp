#include "panelgate/audit/verify.hpp"

#include <algorithm>
#include <regex>
#include <utility>

#include "panelgate/audit/files.hpp"
#include "panelgate/base/text.hpp"

namespace panelgate::audit {

namespace {

std::string record_text(std::uint64_t number) { return "record " + std::to_string(number); }

/// "records 5 to 7", or "record 5".
std::string records_text(std::uint64_t first, std::uint64_t last) {
    if (first == last) return record_text(first);
    return "records " + std::to_string(first) + " to " + std::to_string(last);
}

std::uint64_t number_in(std::string_view text) {
    return to_number<std::uint64_t>(text).value_or(0);
}

/// The fields of an event, or none. panelgate itself writes no bare quote in a value, and a value
/// with a blank stands in quotes: the event stands before the first quote of a line of text, or
/// behind `"MESSAGE":"` (journalctl -o json); in JSON a member begins with `,"`.
std::cmatch fields_of(std::string_view line, const std::regex& as_text, const std::regex& as_json) {
    std::cmatch fields;
    const char* const end = line.data() + line.size();
    if (std::regex_search(line.data(), end, fields, as_json)) return fields;
    static const std::regex message(R"re((?:^|[{,])"MESSAGE":")re");
    const char* begin = line.data();
    if (std::cmatch found; std::regex_search(begin, end, found, message))
        begin = found.suffix().first;
    const std::string_view rest(begin, static_cast<std::size_t>(end - begin));
    std::regex_search(begin, end, fields, as_text);
    if (!fields.empty() && rest.find('"') < static_cast<std::size_t>(fields.position(0))) return {};
    return fields;
}

}  // namespace

void collect_anchor(std::string_view log_line, Anchors& anchors) {
    static const std::regex lost(R"re((?:^|[ >])error audit records lost count=(\d{1,19}))re");
    static const std::regex lost_json(R"re(,"event":"audit records lost","count":"(\d{1,19})")re");
    static const std::regex anchor(
        R"re((?:^|[ >])info audit anchor number=(\d{1,19}) hash=([0-9a-f]{16,64})(?![0-9a-f]))re"
        R"re((?: chain=([0-9a-f]*)(?: file=([^ \r"\\]+))?)?)re");
    static const std::regex anchor_json(
        R"re(,"event":"audit anchor","number":"(\d{1,19})","hash":"([0-9a-f]{16,64})")re"
        R"re((?:,"chain":"([0-9a-f]*)"(?:,"file":"([^"]+)")?)?)re");
    if (log_line.find("audit ") == log_line.npos) return;
    if (const auto said = fields_of(log_line, lost, lost_json); !said.empty())
        anchors.lost += number_in(said.str(1));
    const auto said = fields_of(log_line, anchor, anchor_json);
    const std::uint64_t number = said.empty() ? 0 : number_in(said.str(1));
    if (number == 0) return;
    anchors.chains[said.str(3)][number] = said.str(2);
    if (said[4].matched) anchors.files[said.str(3)] = said.str(4);
}

namespace {

/// Judges line by line. Pure, but for reading.
class Verifier {
  public:
    Verifier(const Anchors& anchors, const std::string& all_of)
        : anchors_(anchors), all_of_(all_of) {}

    /// False: nothing more needs to be read.
    bool read(const std::string& file) {
        file_ = file;
        line_ = 0;
        const std::string why = read_lines(
            file, [this](std::string_view line, bool whole) { return take(line, whole); });
        if (!why.empty()) report_.unread = file + ": " + why;
        return why.empty() && !report_.fault;
    }

    Report finish() {
        if (!report_.fault) {
            line_ = 0;
            check_begin();
            if (!report_.fault) check_end();
            if (!report_.fault) check_gone();
        }
        if (anchors_.lost > 0)
            note("the log says that " + std::to_string(anchors_.lost) +
                 " records could not be written when a run ended");
        for (const auto& [chain, named] : anchors_.chains)
            if (chain != report_.chain) check_other_chain(chain, named.rbegin()->first);
        return std::move(report_);
    }

  private:
    void fail(std::string_view kind, std::string text) {
        report_.fault = Fault{kind, file_, line_, std::move(text)};
    }

    bool take(std::string_view line, bool whole) {
        ++line_;
        const auto record = whole ? parse_line(line) : std::nullopt;
        if (record && report_.records == 0) begin_chain(*record);
        const std::string expected = record_text(report_.last.number + 1);
        if (!whole)
            fail("torn",
                 "the last line is not whole: the gateway was killed while it "
                 "was written, or the end was cut off");
        else if (!record)
            fail("changed", expected + " is no record any more, or a line was added before it");
        else if (!report_.fault)
            judge(*record);
        return !report_.fault;
    }

    /// The oldest file names what it follows; older ones may have been dropped by rotation.
    void begin_chain(const Sealed& record) {
        report_.first = record.number;
        if (record.number == 1) return;
        const std::string previous(member_of(record.body, "previous"));
        report_.last = {record.number - 1, previous};
        if (member_of(record.body, "kind") != "file")
            fail("removed", "the files begin with " + record_text(record.number) +
                                ", which does not begin a file: what stood before it "
                                "was removed");
    }

    void judge(const Sealed& record) {
        const Position last = report_.last;
        const std::string found = record_text(record.number);
        if (record.number > last.number + 1)
            return fail("removed", records_text(last.number + 1, record.number - 1) +
                                       " removed, or put elsewhere, before " + found);
        if (record.number <= last.number)
            return fail("added", found + " stands again behind " + record_text(last.number));
        if (text_of(digest_.of(last.hash, record.text)) != record.hash)
            return fail("changed", found + " was changed, or the hash of the one before");
        report_.last = {record.number, std::string(record.hash)};
        ++report_.records;
        if (member_of(record.body, "kind") == "file") look_at_file(record);
        remark(record);
        if (!report_.fault) compare(record);
    }

    /// Each file names its chain, and from which record on files are kept.
    void look_at_file(const Sealed& record) {
        const std::string chain(member_of(record.body, "chain"));
        if (has_chain_ && chain != report_.chain)
            fail("changed", record_text(record.number) + " begins a file of another chain");
        report_.chain = chain;
        has_chain_ = true;
        kept_from_ = number_in(member_of(record.body, "from"));
        const std::uint64_t gone = number_in(member_of(record.body, "gone"));
        if (gone > 0 && (gone_ == 0 || gone < gone_)) gone_ = gone;
        if (gone > 0) gone_before_ = record.number;
    }

    void compare(const Sealed& record) {
        const auto named = anchors_.chains.find(report_.chain);
        if (named == anchors_.chains.end() || !named->second.contains(record.number)) return;
        ++report_.anchored;
        if (!record.hash.starts_with(named->second.at(record.number)))
            fail("anchor", record_text(record.number) +
                               " is another one than the log names: the chain was made "
                               "anew, from there or from an earlier record on");
    }

    void note(std::string text) {
        constexpr std::size_t kMost = 1000;
        if (report_.remarks.size() < kMost) report_.remarks.push_back(std::move(text));
    }

    /// What the records themselves say is missing.
    void remark(const Sealed& record) {
        constexpr std::pair<std::string_view, std::string_view> kSaid[] = {
            {"gone",
             "the file before was removed, moved away, or changed by others; first record: "},
            {"count", "left out, because the disk took nothing: "},
            {"unclean", "the run before did not end in order, its last second may be missing"},
            {"torn_bytes", "bytes of a torn line, which this record quotes: "},
            {"remark", ""}};
        const std::string_view kind = member_of(record.body, "kind");
        if (kind != "lost" && kind != "start" && kind != "file") return;
        for (const auto& [key, text] : kSaid) {
            const std::string value(member_of(record.body, key));
            if (value.empty()) continue;
            note(record_text(record.number) + " (" + std::string(member_of(record.body, "time")) +
                 "): " + std::string(text) + (value == "true" ? "" : value));
        }
    }

    /// Files that the chain itself says are kept must be there.
    void check_begin() {
        if (report_.records == 0 || kept_from_ == 0 || report_.first <= kept_from_) return;
        const std::string missing = records_text(kept_from_, report_.first - 1);
        if (all_of_.empty())
            note("these files begin with " + record_text(report_.first) + "; " + missing +
                 " stand in other files of this audit");
        else
            fail("removed", missing +
                                " removed: rotation has dropped only what stood "
                                "before");
    }

    /// The last record in the log must be in the files, and the log must name a record of the
    /// files.
    void check_end() {
        const std::uint64_t last = report_.last.number;
        const auto named = anchors_.chains.find(report_.chain);
        const std::uint64_t most =
            named == anchors_.chains.end() ? 0 : named->second.rbegin()->first;
        if (most > last)
            fail("removed", records_text(last + 1, most) + " removed at the end: the log names " +
                                record_text(most));
        else if (anchors_.is_read && report_.records > 0 && report_.anchored == 0)
            fail("anchor",
                 "the log names no record of the chain '" + report_.chain +
                     "', so nothing was compared: it is another log, or the chain was made anew");
    }

    /// Records of a file that went while it was written, unless that file is among those read.
    void check_gone() {
        if (gone_ == 0 || report_.first <= gone_) return;
        fail("removed", records_text(gone_, gone_before_ - 1) +
                            " removed, moved away, or changed by others while the gateway ran");
    }

    /// The files of another chain that was written to the same file were removed, or moved away.
    void check_other_chain(const std::string& chain, std::uint64_t last) {
        const auto file = anchors_.files.find(chain);
        const bool was_here = file != anchors_.files.end() && file->second == all_of_;
        const std::string text =
            "the log names records of another chain '" + chain + "', up to " + record_text(last);
        if (was_here && !report_.fault)
            fail("removed", text + ", which were written to this file and are not there");
        else
            note(text);
    }

    const Anchors& anchors_;
    const std::string& all_of_;
    bool has_chain_ = false;         ///< report_.chain is known
    std::uint64_t kept_from_ = 0;    ///< the first record that was not dropped by rotation
    std::uint64_t gone_ = 0;         ///< the first record of a file that went; 0: none
    std::uint64_t gone_before_ = 0;  ///< the record that says so
    Sha256 digest_;
    Report report_;
    std::string file_;
    std::uint64_t line_ = 0;
};

}  // namespace

Report verify(std::vector<std::string> files, const Anchors& anchors, const std::string& all_of) {
    std::ranges::sort(files, {}, first_record);
    Verifier verifier(anchors, all_of);
    for (const std::string& file : files)
        if (!verifier.read(file)) break;
    return verifier.finish();
}

}  // namespace panelgate::audit
