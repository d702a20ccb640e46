#include "panelgate/yaml/document.hpp"

#include <yaml-cpp/anchor.h>
#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>
#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "advice.hpp"
#include "encoding.hpp"
#include "panelgate/yaml/settings.hpp"
#include "source.hpp"

namespace panelgate::yaml {

/// Rewords a yaml-cpp error for the user, where no lint explains it.
std::string reword_error(std::string_view refusal);

std::string quote(std::string_view text) {
    constexpr std::size_t kMost = 80;
    std::string shown(clip(text, kMost));
    const bool is_cut = shown.size() < text.size();
    std::ranges::replace_if(shown, [](char c) { return (c >= 0 && c < ' ') || c == 0x7F; }, ' ');
    const char mark = shown.find('\'') == shown.npos || shown.find('"') != shown.npos ? '\'' : '"';
    return mark + shown + (is_cut ? "..." : "") + mark;
}

std::string written(std::string_view text) {
    constexpr std::array<std::string_view, 5> kNull{"", "~", "null", "Null", "NULL"};
    constexpr std::string_view kIndicators = "-?:,[]{}#&*!|>'\"%@` ";
    const bool plain = std::ranges::find(kNull, text) == kNull.end() &&
                       kIndicators.find(text.front()) == kIndicators.npos && text.back() != ':' &&
                       text.back() != ' ' && text.find(": ") == text.npos &&
                       text.find(" #") == text.npos && text.find_first_of(",[]{}$") == text.npos;
    if (plain) return std::string(text);
    std::string made = "'";
    for (const char c : text) made += c == '\'' ? "''" : c == '$' ? "$$" : std::string(1, c);
    return made + '\'';
}

namespace {

const std::string kTooDeep = "nested deeper than " + std::to_string(kMaxDepth) + " levels";
const std::string kTooManyNodes = "more than " + std::to_string(kMaxNodes) +
                                  " values, repetitions by aliases (*) included; split the file";
const std::string kTooMuchText = "more than " + std::to_string(kMaxText / 1024 / 1024) +
                                 " MiB of text, repetitions by aliases (*) included; repeat less";

/// Ends the parsing.
struct TooLarge {
    Mark mark;
    std::string message;
};

/// Text at the left margin below an indented document, which yaml-cpp takes for a second document.
struct Stray {
    Mark mark;
};

/// Builds our tree from the parser's events, which have marks, duplicate keys and aliases
/// (yaml-cpp's own tree silently keeps the first of two equal keys).
class Builder final : public YAML::EventHandler {
  public:
    Builder(const Source& source, Problems& problems) : source_(source), problems_(problems) {}

    void OnDocumentStart(const YAML::Mark& mark) override { start_ = mark_of(mark); }
    void OnDocumentEnd() override {}
    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        charge(mark_of(mark), {1});
        Node node;
        node.mark = mark_of(mark);
        node.comma = source_.byte(mark.line, mark.column) == ',';
        put(std::move(node), anchor);
    }
    void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        const auto found = anchors_.find(anchor);
        if (found == anchors_.end()) {
            problems_.add(mark_of(mark), "an alias must not be inside what it repeats");
            OnNull(mark, YAML::NullAnchor);
            return;
        }
        const Size size = size_of(found->second);
        if (stack_.size() + size.depth > kMaxDepth) throw TooLarge{mark_of(mark), kTooDeep};
        charge(mark_of(mark), size);
        Node node = found->second;
        node.mark = mark_of(mark);
        place(std::move(node));
    }
    void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        check_tag(mark, tag);
        if (tag == "!" && source_.byte(mark.line, mark.column) == '!')
            problems_.add(mark_of(mark),
                          "a '!' alone is no value; write one, or \"!\" for the text");
        charge(mark_of(mark), {1, value.size(), 0});
        Node node;
        node.kind = Node::Kind::scalar;
        node.mark = mark_of(mark);
        node.scalar = unmask_variables(value);
        node.quoted = tag == "!";
        put(std::move(node), anchor);
    }
    void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value) override {
        check_tag(mark, tag);
        open(Node::Kind::sequence, mark, anchor);
    }
    void OnSequenceEnd() override { close(); }
    void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value) override {
        check_tag(mark, tag);
        open(Node::Kind::map, mark, anchor);
    }
    void OnMapEnd() override { close(); }

    Mark mark_of(const YAML::Mark& mark) const { return source_.mark(mark.line, mark.column); }
    Mark start() const { return start_; }
    Node take() { return std::move(root_); }

  private:
    struct Open {
        Node node;
        YAML::anchor_t anchor = YAML::NullAnchor;
        bool has_key = false;  ///< `pending` has a key and waits for its value
        Entry pending;
        bool refused = false;     ///< that key was refused: its value is dropped
        bool lacks_dash = false;  ///< its keys repeat, so they are another item's; reported once
        std::map<std::string, int> seen;  ///< key -> line
    };

    /// "?" is a plain value, "!" a quoted one; anything else is a tag in the file.
    void check_tag(const YAML::Mark& mark, const std::string& tag) {
        if (tag.empty() || tag == "?" || tag == "!") return;
        const bool lookup = tag == "!secret" || tag == "!env_var" || tag == "!env" || tag == "!ENV";
        problems_.add(mark_of(mark),
                      "a tag (" + quote(tag) + ") has no meaning here; " +
                          (lookup ? "a variable of the environment is written ${NAME}"
                           : tag == "!include"
                               ? "the configuration is one file; put in its place what the other "
                                 "one holds"
                               : "leave it out, or put the text in quotes"));
    }
    void open(Node::Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor) {
        if (stack_.size() >= kMaxDepth) throw TooLarge{mark_of(mark), kTooDeep};
        charge(mark_of(mark), {1});
        Open level;
        level.node.kind = kind;
        level.node.mark = mark_of(mark);
        level.anchor = anchor;
        stack_.push_back(std::move(level));
    }
    void close() {
        Open level = std::move(stack_.back());
        stack_.pop_back();
        put(std::move(level.node), level.anchor);
    }
    /// Checks the limits before memory is used: a 1 MB file may expand to gigabytes.
    void charge(Mark mark, const Size& size) {
        nodes_ += size.nodes;
        text_ += size.text;
        if (nodes_ > kMaxNodes) throw TooLarge{mark, kTooManyNodes};
        if (text_ > kMaxText) throw TooLarge{mark, kTooMuchText};
    }
    void put(Node node, YAML::anchor_t anchor) {
        if (anchor != YAML::NullAnchor) {
            charge(node.mark, size_of(node));
            anchors_[anchor] = node;
        }
        place(std::move(node));
    }
    void place(Node node) {
        if (stack_.empty()) {
            root_ = std::move(node);
            return;
        }
        Open& level = stack_.back();
        if (level.node.kind == Node::Kind::sequence) {
            if (is_comma(node)) return;
            if (node.kind == Node::Kind::null) node.mark = dash_before(node.mark);
            level.node.items.push_back(std::move(node));
        } else if (!level.has_key) {
            put_key(level, node);
        } else {
            put_value(level, std::move(node));
        }
    }
    /// The parser marks an empty item at the next token, maybe lines below.
    Mark dash_before(Mark next) const {
        const std::string_view line = source_.line(next.line);
        const std::size_t column = static_cast<std::size_t>(next.column) - 1;
        const std::string_view here = line.substr(std::min(column, line.size()));
        for (const std::string_view typed : {"~", "null", "Null", "NULL", "]", ","})
            if (here.starts_with(typed)) return next;
        for (int number = next.line; number > 0; --number) {
            const std::string_view text = source_.line(number);
            const std::size_t at = text.find_first_not_of(' ');
            if (at != text.npos && text[at] == '-' && (number < next.line || at < column))
                return {number, static_cast<int>(at) + 1};
        }
        return next;
    }
    /// Reports and skips an empty value between two commas of [a,, b] and {a: 1,, b: 2}.
    bool is_comma(const Node& node) {
        if (node.kind != Node::Kind::null || !node.comma) return false;
        problems_.add(node.mark, "a ',' too many; remove it");
        return true;
    }
    void put_key(Open& level, const Node& node) {
        level.pending = Entry{node.scalar, node.mark, {}};
        level.has_key = true;
        level.refused = true;
        if (is_comma(node)) return;
        if (node.kind != Node::Kind::scalar) {
            const bool is_map = node.kind == Node::Kind::map;  // probably {{ NAME }}
            problems_.add(node.mark,
                          std::string("a key must be a word") +
                              (is_map ? ", not a map; a variable is written ${NAME}" : ""));
            return;
        }
        const auto [first, fresh] = level.seen.emplace(node.scalar, node.mark.line);
        level.refused = !fresh;
        if (fresh || level.lacks_dash) return;
        level.lacks_dash = begins_item(level, node.scalar);
        problems_.add(node.mark, "duplicate key " + quote(node.scalar) + ", already on line " +
                                     std::to_string(first->second) +
                                     (level.lacks_dash ? "; is a '- ' missing before it?" : ""));
    }
    /// True if the map is an item of a list and this is its first key.
    bool begins_item(const Open& level, const std::string& key) const {
        const bool is_item =
            stack_.size() > 1 && stack_[stack_.size() - 2].node.kind == Node::Kind::sequence;
        return is_item && !level.node.entries.empty() && level.node.entries.front().key == key;
    }
    /// True for `scale: 0,1` inside brackets, which is parsed as `scale: 0` and a key 1.
    static bool is_decimal_comma(const Open& level, const Node& value) {
        if (value.kind != Node::Kind::null || level.node.entries.empty()) return false;
        constexpr std::string_view kNumber = "-0123456789,";
        const Node& before = level.node.entries.back().value;
        const Entry& key = level.pending;
        const bool number =
            !before.scalar.empty() && before.scalar.find_first_not_of(kNumber) == std::string::npos;
        return number && !key.key.empty() && key.key[0] >= '0' && key.key[0] <= '9' &&
               before.mark.line == key.mark.line &&
               before.mark.column + static_cast<int>(before.scalar.size()) + 1 == key.mark.column;
    }
    void put_value(Open& level, Node node) {
        level.has_key = false;
        if (level.refused) return;
        if (is_decimal_comma(level, node)) {
            Node& number = level.node.entries.back().value;
            number.scalar += ',' + level.pending.key;
            number.comma = true;
            return;
        }
        Entry entry = std::move(level.pending);
        // The parser marks an empty value at the next token, maybe lines below.
        if (node.kind == Node::Kind::null) {
            node.mark = entry.mark;
            node.comma = false;
        }
        entry.value = std::move(node);
        level.node.entries.push_back(std::move(entry));
    }

    const Source& source_;
    Problems& problems_;
    Mark start_;
    std::vector<Open> stack_;
    std::map<YAML::anchor_t, Node> anchors_;
    std::size_t nodes_ = 0;
    std::size_t text_ = 0;
    Node root_;
};

/// Returns false if there is one. Text after a document without a marker is no YAML (Stray).
bool refuse_second_document(YAML::Parser& parser, const Source& source, Problems& problems) {
    Problems unused("");
    Builder second(source, unused);
    if (!parser.HandleNextDocument(second)) return true;
    const Mark start = second.start();
    const bool begun = source.line(start.line).starts_with("---") ||
                       source.line(start.line - 1).starts_with("...");
    if (!begun) throw Stray{start};
    problems.add(start, "a second document; the file must hold one only");
    return false;
}

void add(const Source& source, const Findings& findings, Problems& problems) {
    for (const Finding& finding : findings) {
        const Mark mark = source.mark(finding.offset);
        problems.add(mark, finding.message, source.excerpt(mark));
    }
}

/// A decoded text, and what its author may have meant where it is no YAML.
struct Text {
    Text(std::string all, std::span<const std::string_view> of_top)
        : source(std::move(all)),
          masked(mask_variables(source.text())),
          lines(masked),
          sections(of_top) {}

    Source source;
    std::string masked;
    Lines lines;
    std::span<const std::string_view> sections;
};

/// Adds the causes, or `otherwise` at the place of the error.
void explain(const Text& text, Mark mark, std::string otherwise, Problems& problems) {
    const Findings causes =
        find_causes(text.source.text(), text.lines, text.source.end_of(mark.line), text.sections);
    add(text.source, causes, problems);
    if (causes.empty()) problems.add(mark, std::move(otherwise), text.source.excerpt(mark));
}

/// Returns false if yaml-cpp refused the text: the reason goes to `problems`, other faults to
/// `found`.
bool build(const Text& text, Builder& builder, Problems& problems, Problems& found) {
    try {
        std::istringstream in{without_blank_tabs(text.masked)};
        YAML::Parser parser(in);
        return !parser.HandleNextDocument(builder) ||
               refuse_second_document(parser, text.source, found);
    } catch (const TooLarge& reason) {
        problems.add(reason.mark, reason.message);
    } catch (const YAML::DeepRecursion& error) {
        problems.add(builder.mark_of(error.mark), kTooDeep);
    } catch (const Stray& stray) {
        explain(text, stray.mark,
                "this belongs to nothing above it; the file must be one map of "
                "keys, such as 'lines:'",
                problems);
    } catch (const YAML::Exception& error) {
        explain(text, builder.mark_of(error.mark), reword_error(error.msg), problems);
    }
    return false;
}

}  // namespace

Node parse(std::string_view bytes, Problems& problems, std::span<const std::string_view> sections) {
    Decoded decoded = decode(bytes);
    const Text text(std::move(decoded.text), sections);
    const Source& source = text.source;
    add(source, decoded.bad, problems);
    if (!decoded.bad.empty()) return {};  // all later problems may follow from it
    if (text.lines.too_deep) {            // yaml-cpp would use 2 GB for 8 MB of brackets
        problems.add(source.mark(*text.lines.too_deep), kTooDeep);
        return {};
    }
    Problems found(problems.file());
    Builder builder(source, found);
    Problems refusal(problems.file());
    const bool built = build(text, builder, refusal, found);
    const Findings traps = built ? find_traps(source.text(), text.lines) : Findings();
    add(source, traps, problems);
    if (!traps.empty()) return {};  // the parsed tree is not what the user meant
    problems.take(refusal);
    problems.take(found);
    if (!built) return {};
    Node root = builder.take();
    // A file of lines such as `device = /dev/ttyUSB0` is a single text.
    const bool is_text = root.kind == Node::Kind::scalar && !root.quoted;
    if (!is_text || root.scalar.find_first_of("=:") == root.scalar.npos) return root;
    const Findings causes = find_causes(source.text(), text.lines, source.text().size(), sections);
    add(source, causes, problems);
    return causes.empty() ? root : Node();
}

Node* Node::find(std::string_view key) {
    for (Entry& entry : entries)
        if (entry.key == key) return &entry.value;
    return nullptr;
}

Size size_of(const Node& node) {
    Size size{1, node.scalar.size(), 0};
    const auto add = [&size](const Node& child) {
        const Size inner = size_of(child);
        size.nodes += inner.nodes;
        size.text += inner.text;
        size.depth = std::max(size.depth, inner.depth);
    };
    for (const Node& item : node.items) add(item);
    for (const Entry& entry : node.entries) {
        size.text += entry.key.size();
        add(entry.value);
    }
    if (node.kind == Node::Kind::sequence || node.kind == Node::Kind::map) ++size.depth;
    return size;
}

namespace {

struct Words {
    std::string_view refusal;  ///< how it begins (yaml-cpp/exceptions.h)
    std::string_view ours;
};

constexpr std::string_view kIndentation =
    "the indentation is wrong here or above: keys of one map, and the '-' of one list, are in one "
    "column";
constexpr std::string_view kBracket =
    "a bracket or a comma is missing before this: write {key: value, key: value} or [a, b]";
constexpr std::string_view kColon =
    "a key cannot be here: write each 'key: value' on a line of its own, in the column of its "
    "neighbours";
constexpr std::string_view kName = "a name of letters and digits must follow & or *";
constexpr std::string_view kTag = "a tag (!...) has no meaning here; leave it out";
constexpr std::string_view kDirective = "a directive (%...) has no meaning here; leave it out";
constexpr std::string_view kHex =
    "what follows this backslash is no character; write \\xNN or \\uNNNN, or \\\\ for a backslash";

constexpr std::array<Words, 28> kLibraryMessages{{
    {"end of map flow", kBracket},
    {"end of sequence flow", kBracket},
    {"illegal flow end", kBracket},
    {"end of map", kIndentation},
    {"end of sequence", kIndentation},
    {"illegal map", kColon},
    {"unexpected end", kIndentation},
    {"illegal block entry",
     "a '-' cannot be here: write each item of a list on a line of its own, below a key without a "
     "value"},
    {"illegal tab", "a tab in the indentation; type blanks in its place"},
    {"unknown token", "this character cannot begin a text; put the text in quotes"},
    {"the referenced anchor",
     "'*' repeats a name that no '&' before it gives; put a text that begins with '*' in quotes"},
    {"unknown escape", "this backslash means nothing in double quotes; write \\\\ for a backslash"},
    {"bad character found while scanning hex", kHex},
    {"invalid unicode", kHex},
    {"alias not found", kName},
    {"anchor not found", kName},
    {"illegal character found while scanning alias", kName},
    {"illegal character found while scanning anchor", kName},
    {"illegal character found while scanning tag", kTag},
    {"tag handle", kTag},
    {"end of verbatim tag", kTag},
    {"cannot assign multiple", "more than one & or ! before one value; leave one out"},
    {"aliases can't", "nothing may be between * and what it repeats; leave it out"},
    {"cannot set zero", "0 cannot follow | or >; leave it out"},
    {"unexpected character in block", "only a comment may follow | or > on its line"},
    {"bad YAML version", kDirective},
    {"YAML ", kDirective},
    {"repeated ", kDirective},
}};

}  // namespace

std::string reword_error(std::string_view refusal) {
    for (const Words& words : kLibraryMessages) {
        if (refusal.starts_with(words.refusal)) return std::string(words.ours);
    }
    return "this is not YAML (" + std::string(refusal) + "); put texts in quotes";
}

std::string format(const Problem& problem) {
    return problem.file + ':' + std::to_string(problem.mark.line) + ':' +
           std::to_string(problem.mark.column) + ": " + problem.message;
}

std::vector<Problem> Problems::shown() const {
    std::vector<const Problem*> sorted;
    sorted.reserve(list_.size());
    for (const Problem& problem : list_) sorted.push_back(&problem);
    const auto place = [this](const Problem* problem) {
        return std::tuple(problem->file != file_, std::string_view(problem->file),
                          problem->mark.line, problem->mark.column, problem);
    };
    std::ranges::sort(sorted, {}, place);  // at one place: in the order found
    const std::size_t shown = sorted.size() > kMaxShown + 1 ? kMaxShown : sorted.size();
    std::vector<Problem> all;
    for (std::size_t i = 0; i < shown; ++i) all.push_back(*sorted[i]);
    if (shown == sorted.size()) return all;
    all.push_back({sorted[shown]->file, sorted[shown]->mark,
                   std::to_string(sorted.size() - shown) +
                       " more faults from here on; mend those above and check again"});
    return all;
}

std::string Problems::text() const {
    std::string all;
    for (const Problem& problem : shown()) all += format(problem) + '\n' + problem.excerpt;
    return all;
}

}  // namespace panelgate::yaml
