#include "panelgate/yaml/document.hpp"

#include <yaml-cpp/anchor.h>
#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <tuple>

#include "masking.hpp"

namespace panelgate::yaml {

std::string format(const Problem& problem) {
    return problem.file + ':' + std::to_string(problem.mark.line) + ':' +
           std::to_string(problem.mark.column) + ": " + problem.message;
}

std::string Problems::text() const {
    std::vector<const Problem*> sorted;
    sorted.reserve(list_.size());
    for (const Problem& problem : list_) sorted.push_back(&problem);
    const auto place = [this](const Problem* problem) {
        return std::tuple(problem->file != file_, std::string_view(problem->file),
                          problem->mark.line, problem->mark.column, problem);
    };
    std::ranges::sort(sorted, {}, place);  // at one place: in the order found
    std::string all;
    for (const Problem* problem : sorted) all += format(*problem) + '\n';
    return all;
}

namespace {

constexpr std::size_t kMaxDepth = 64;
constexpr std::size_t kMaxNodes = 100'000;
const std::string kTooDeep = "nested deeper than " + std::to_string(kMaxDepth) + " levels";

/// Ends the parsing.
struct TooLarge {
    Mark mark;
    std::string message;
};

/// yaml-cpp counts from 0.
Mark mark_of(const YAML::Mark& mark) { return {mark.line + 1, mark.column + 1}; }

struct Size {
    std::size_t nodes = 1;
    std::size_t depth = 0;  ///< levels of lists and maps
};

Size size_of(const Node& node) {
    Size size;
    const auto add = [&size](const Node& child) {
        const Size inner = size_of(child);
        size.nodes += inner.nodes;
        size.depth = std::max(size.depth, inner.depth);
    };
    for (const Node& item : node.items) add(item);
    for (const Entry& entry : node.entries) add(entry.value);
    if (node.kind == Node::Kind::sequence || node.kind == Node::Kind::map) ++size.depth;
    return size;
}

/// Builds our tree from the parser's events, where marks, duplicate keys and aliases are all at
/// hand (yaml-cpp's own tree keeps the first of two equal keys silently).
class Builder final : public YAML::EventHandler {
  public:
    explicit Builder(Problems& problems) : problems_(problems) {}

    void OnDocumentStart(const YAML::Mark& mark) override { start_ = mark_of(mark); }
    void OnDocumentEnd() override {}
    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        Node node;
        node.mark = mark_of(mark);
        put(std::move(node), anchor);
    }
    void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        const auto found = anchors_.find(anchor);
        if (found == anchors_.end()) {
            problems_.add(mark_of(mark), "an alias must not stand inside what it repeats");
            OnNull(mark, YAML::NullAnchor);
            return;
        }
        const Size size = size_of(found->second);
        if (stack_.size() + size.depth > kMaxDepth) throw TooLarge{mark_of(mark), kTooDeep};
        nodes_ += size.nodes - 1;  // put() counts one
        Node node = found->second;
        node.mark = mark_of(mark);
        put(std::move(node), YAML::NullAnchor);
    }
    void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        check_tag(mark, tag);
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

    Mark start() const { return start_; }
    Node take() { return std::move(root_); }

  private:
    struct Open {
        Node node;
        YAML::anchor_t anchor = YAML::NullAnchor;
        bool has_key = false;  ///< `pending` has a key and waits for its value
        Entry pending;
        bool refused = false;             ///< that key: its value is dropped
        std::map<std::string, int> seen;  ///< key -> line
    };

    /// "?" is a plain value, "!" a quoted one; anything else was written by hand.
    void check_tag(const YAML::Mark& mark, const std::string& tag) {
        if (tag.empty() || tag == "?" || tag == "!") return;
        problems_.add(mark_of(mark), "a tag ('" + tag + "') has no meaning here; leave it out");
    }
    void open(Node::Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor) {
        if (stack_.size() >= kMaxDepth) throw TooLarge{mark_of(mark), kTooDeep};
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
    void put(Node node, YAML::anchor_t anchor) {
        if (++nodes_ > kMaxNodes) {
            throw TooLarge{node.mark, "more than " + std::to_string(kMaxNodes) + " values"};
        }
        if (anchor != YAML::NullAnchor) anchors_[anchor] = node;
        if (stack_.empty()) {
            root_ = std::move(node);
            return;
        }
        Open& level = stack_.back();
        if (level.node.kind == Node::Kind::sequence) {
            level.node.items.push_back(std::move(node));
        } else if (!level.has_key) {
            put_key(level, node);
        } else {
            put_value(level, std::move(node));
        }
    }
    void put_key(Open& level, const Node& node) {
        level.pending = Entry{node.scalar, node.mark, {}};
        level.has_key = true;
        level.refused = true;
        if (node.kind != Node::Kind::scalar) {
            problems_.add(node.mark, "a key must be a word");
            return;
        }
        const auto [first, fresh] = level.seen.emplace(node.scalar, node.mark.line);
        level.refused = !fresh;
        if (fresh) return;
        problems_.add(node.mark, "duplicate key '" + node.scalar + "', already on line " +
                                     std::to_string(first->second));
    }
    void put_value(Open& level, Node node) {
        level.has_key = false;
        if (level.refused) return;
        Entry entry = std::move(level.pending);
        // An empty value is marked at the next token, maybe lines below.
        if (node.kind == Node::Kind::null) node.mark = entry.mark;
        entry.value = std::move(node);
        level.node.entries.push_back(std::move(entry));
    }

    Problems& problems_;
    Mark start_;
    std::vector<Open> stack_;
    std::map<YAML::anchor_t, Node> anchors_;
    std::size_t nodes_ = 0;
    Node root_;
};

void refuse_second_document(YAML::Parser& parser, Problems& problems) {
    Problems unused("");
    Builder second(unused);
    if (!parser.HandleNextDocument(second)) return;
    problems.add(second.start(), "a second document; the file must hold one only");
}

}  // namespace

Node parse(std::string_view text, Problems& problems) {
    Builder builder(problems);
    try {
        std::istringstream in{mask_variables(text)};
        YAML::Parser parser(in);
        if (parser.HandleNextDocument(builder)) refuse_second_document(parser, problems);
    } catch (const TooLarge& reason) {
        problems.add(reason.mark, reason.message);
    } catch (const YAML::DeepRecursion& error) {
        problems.add(mark_of(error.mark), kTooDeep);
    } catch (const YAML::Exception& error) {
        problems.add(mark_of(error.mark), "not YAML: " + error.msg);
    }
    return builder.take();
}

}  // namespace panelgate::yaml
