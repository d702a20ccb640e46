#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace panelgate::yaml {

/// Returns text for a one-line message: in quotes, cut after 80 bytes, control characters as
/// blanks.
std::string quote(std::string_view text);
/// Returns text as it is typed for the value of a key: in quotes only where it needs them.
std::string written(std::string_view text);

/// A place in a file, 1-based, in characters, as editors count.
struct Mark {
    int line = 1;
    int column = 1;
};

/// One fault in a file, and how to correct it.
struct Problem {
    std::string file;
    Mark mark;
    std::string message;
    /// The line and a caret below it, where that helps; each ends with '\n'.
    std::string excerpt = {};
};
/// Returns "FILE:LINE:COLUMN: message" (HR-17), without the excerpt.
std::string format(const Problem& problem);

/// Collects every problem of one file, and of the files it names, in the order found.
class Problems {
  public:
    explicit Problems(std::string file) : file_(std::move(file)) {}
    void add(Mark mark, std::string message, std::string excerpt = {}) {
        list_.push_back({file_, mark, std::move(message), std::move(excerpt)});
    }
    /// Keeps the problem's own file.
    void add(Problem problem) { list_.push_back(std::move(problem)); }
    /// Adds problems of another file, such as a template's file; each problem keeps the name of its
    /// file.
    void take(const Problems& other) {
        list_.insert(list_.end(), other.list_.begin(), other.list_.end());
    }
    bool empty() const { return list_.empty(); }
    const std::vector<Problem>& list() const { return list_; }
    /// Takes what follows `password`, `token`, `secret` and the like in the file's text out of its
    /// problems' messages: they go to the log, and to whoever may ask what came of a reload. A
    /// secret does not belong there, but with a slip it is no value of a key that says so.
    void conceal_secrets(std::string_view text);
    /// Returns this file's problems first, then those of other files, by line and column; of many
    /// the first kMaxShown, and how many others there are as the last one.
    std::vector<Problem> shown() const;
    const std::string& file() const { return file_; }
    /// Returns shown(), one line each followed by its excerpt.
    std::string text() const;

  private:
    std::string file_;
    std::vector<Problem> list_;
};

struct Entry;

/// A parsed YAML value. Scalars stay text: the reader decides what "010" or "yes" means (yaml-cpp
/// would make 010 an 8). Maps keep the order of the file; keys are unique.
struct Node {
    enum class Kind { null, scalar, sequence, map };

    Kind kind = Kind::null;
    Mark mark;             ///< for a null in a map: its key's mark
    std::string scalar;    ///< Kind::scalar
    bool quoted = false;   ///< the scalar was in quotes
    std::string variable;  ///< name of the variable that supplied the scalar, such as BAUD; quotes
                           ///< then only enclose it
    bool comma = false;    ///< written with a ',' in { }, which ends a value there: not a text
    std::vector<Node> items;     ///< Kind::sequence
    std::vector<Entry> entries;  ///< Kind::map

    /// True if typed in quotes: never a number, nor true or false.
    bool is_text() const { return quoted && variable.empty(); }
    /// Returns the value of a map's key; nullptr if it has none.
    Node* find(std::string_view key);
    const Node* find(std::string_view key) const { return const_cast<Node*>(this)->find(key); }
};

struct Entry {
    std::string key;
    Mark mark;  ///< of the key
    Node value;
};

/// Size of a value, with all that is in it.
struct Size {
    std::size_t nodes = 0;
    std::size_t text = 0;   ///< bytes of scalars and keys
    std::size_t depth = 0;  ///< levels of lists and maps
};
Size size_of(const Node& node);

/// Parses one YAML document in any Unicode encoding. Adds to `problems`: invalid text, syntax
/// errors (at their cause, if it can be found), unclosed quotes, duplicate keys, non-scalar keys,
/// tags, a second document, and what exceeds a limit of settings.hpp (aliases count as what they
/// repeat). Returns what could be read (a null node if nothing).
/// `sections`: keys of the outermost map, for advice about indentation.
Node parse(std::string_view text, Problems& problems,
           std::span<const std::string_view> sections = {});

}  // namespace panelgate::yaml
