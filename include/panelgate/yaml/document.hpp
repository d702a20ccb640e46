#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace panelgate::yaml {

/// A text of a file in a message of one line: in quotes, cut after 80 bytes, without control
/// characters.
std::string quote(std::string_view text);

class Description;

/// A place in a file, 1-based, in characters, as editors count.
struct Mark {
    int line = 1;
    int column = 1;
};

/// One thing that is wrong with a file, and what would be right.
struct Problem {
    std::string file;
    Mark mark;
    std::string message;
    /// The line and a caret below it, where that helps: lines, each ended by '\n'.
    std::string excerpt = {};
};
/// "FILE:LINE:COLUMN: message" (HR-17), without the excerpt.
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
    /// Adds those of another file that this one names; they keep their file.
    void take(const Problems& other) {
        list_.insert(list_.end(), other.list_.begin(), other.list_.end());
    }
    bool empty() const { return list_.empty(); }
    const std::vector<Problem>& list() const { return list_; }
    const std::string& file() const { return file_; }
    /// Where those who read write down what they ask for; nullptr, as a rule: nowhere. Outlives
    /// this.
    void describe(Description* description) { description_ = description; }
    Description* description() const { return description_; }
    /// This file's first, then those of other files; sorted by line and column, one line each, with
    /// its excerpt behind it. Of many, the first kMaxTold and how many there are more.
    std::string text() const;

  private:
    std::string file_;
    std::vector<Problem> list_;
    Description* description_ = nullptr;
};

struct Entry;

/// A parsed YAML value. Scalars stay text: what "010" or "yes" means is decided by who reads them
/// (yaml-cpp would make 010 an 8). Maps keep the order of the file; keys are unique.
struct Node {
    enum class Kind { null, scalar, sequence, map };

    Kind kind = Kind::null;
    Mark mark;                   ///< of a null in a map: its key's mark
    std::string scalar;          ///< Kind::scalar
    bool quoted = false;         ///< the scalar stood in quotes
    std::string variable;        ///< whose value is in the scalar, such as BAUD; then quotes only
                                 ///< fence it
    bool comma = false;          ///< typed with a ',' in { }, where that ends a value: no text
    std::vector<Node> items;     ///< Kind::sequence
    std::vector<Entry> entries;  ///< Kind::map

    /// Typed in quotes: never a number, nor true or false.
    bool is_text() const { return quoted && variable.empty(); }
};

struct Entry {
    std::string key;
    Mark mark;  ///< of the key
    Node value;
};

/// Parses one YAML document, in any encoding of Unicode. What is no text, syntax errors (at the
/// place of their cause, as far as it can be told), quotes that are not closed, duplicate keys,
/// non-scalar keys, tags, more than one document, and what exceeds a limit of settings.hpp (aliases
/// counted as what they stand for) are added to `problems`; the result is then whatever could be
/// read (a null node if nothing).
Node parse(std::string_view text, Problems& problems);

}  // namespace panelgate::yaml
