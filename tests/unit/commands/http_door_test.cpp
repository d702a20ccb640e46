// Where HTTP listens, and how its metrics are made.
#include "http_door.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::commands::http_door_test {
namespace {

/// Texts that are no YAML, and where their http section listens.
const struct {
    const char* text;
    const char* listen;
} kTexts[] = {
    {"lines: [\nhttp:\n  listen: 127.0.0.1:8081\n", "127.0.0.1:8081"},
    {"http: {listen: 127.0.0.1:8081, anonymous: operator}\nlines: [", "127.0.0.1:8081"},
    {"http: {anonymous: none, listen: \"[::1]:8081\"}\r\nlines: [", "[::1]:8081"},
    {"http:   # ours\r\n\r\n\tlisten: '0.0.0.0:80' # all\r\n}", "0.0.0.0:80"},
    {"\xEF\xBB\xBFhttp: {listen: 127.0.0.1:1}\n[", "127.0.0.1:1"},
    // Of others.
    {"", ""},
    {"modbus_tcp:\n  - listen: 127.0.0.1:502\nhttp:\n  hosts: [x]\nlog: [", ""},
    {"#http: {listen: 127.0.0.1:1}\nhttp:\n# listen: 127.0.0.1:2\n", ""},
    {"http: {hosts: [a]}\nmodbus_tcp: [{listen: 127.0.0.1:502}]\n[", ""},
    {"http:\n  relisten: 127.0.0.1:2\n", ""},
    // Of two none is taken.
    {"<<<<<<< ours\nhttp: {listen: 127.0.0.1:1}\n=======\n"
     "http: {listen: 127.0.0.1:2}\n>>>>>>> theirs\n",
     ""},
    {"http: {listen: 127.0.0.1:1}\nhttp: {listen: 127.0.0.1:1}\n", "127.0.0.1:1"},
};

TEST(ListenInText, IsFoundInATextThatIsNoYamlUnlessItIsNotItsOwn) {
    for (const auto& row : kTexts) EXPECT_EQ(http_listen_in(row.text), row.listen) << row.text;
}

}  // namespace
}  // namespace panelgate::commands::http_door_test
