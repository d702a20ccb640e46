#include "http_door.hpp"

#include <gtest/gtest.h>

namespace panelgate::app::listen_in_text_test {
namespace {

TEST(ListenInText, IsFoundInATextThatIsNoYaml) {
    EXPECT_EQ(http_listen_in("lines: [\nhttp:\n  listen: 127.0.0.1:8081\n"), "127.0.0.1:8081");
    EXPECT_EQ(http_listen_in("http: {listen: 127.0.0.1:8081, anonymous: operator}\nlines: ["),
              "127.0.0.1:8081");
    EXPECT_EQ(http_listen_in("http: {anonymous: none, listen: \"[::1]:8081\"}\r\nlines: ["),
              "[::1]:8081");
    EXPECT_EQ(http_listen_in("http:   # ours\r\n\r\n\tlisten: '0.0.0.0:80' # all\r\n}"),
              "0.0.0.0:80");
}

TEST(ListenInText, OfOthersIsNotItsOwn) {
    EXPECT_EQ(http_listen_in(""), "");
    EXPECT_EQ(http_listen_in("modbus_tcp:\n  - listen: 127.0.0.1:502\nhttp:\n  hosts: [x]\nlog: ["),
              "");
    EXPECT_EQ(http_listen_in("#http: {listen: 127.0.0.1:1}\nhttp:\n# listen: 127.0.0.1:2\n"), "");
    EXPECT_EQ(http_listen_in("http: {hosts: [a]}\nmodbus_tcp: [{listen: 127.0.0.1:502}]\n["), "");
    EXPECT_EQ(http_listen_in("http:\n  relisten: 127.0.0.1:2\n"), "");
}

TEST(ListenInText, WhatIsDeeperIsNotItsOwn) {
    EXPECT_EQ(http_listen_in("http: {tls: {listen: 127.0.0.1:1}}\n["), "");
    EXPECT_EQ(http_listen_in("http: {tls: {listen: 127.0.0.1:1}, listen: 127.0.0.1:2}\n["),
              "127.0.0.1:2");
    EXPECT_EQ(http_listen_in("http:\n  tokens:\n    - listen: 127.0.0.1:1\n["), "");
    EXPECT_EQ(http_listen_in("http:\n  tls:\n    listen: 127.0.0.1:1\n  listen: 127.0.0.1:2\n["),
              "127.0.0.1:2");
}

TEST(ListenInText, OfTwoNoneIsTaken) {
    EXPECT_EQ(http_listen_in("<<<<<<< ours\nhttp: {listen: 127.0.0.1:1}\n=======\n"
                             "http: {listen: 127.0.0.1:2}\n>>>>>>> theirs\n"),
              "");
    EXPECT_EQ(http_listen_in("http: {listen: 127.0.0.1:1}\nhttp: {anonymous: none}\n"), "");
    EXPECT_EQ(http_listen_in("http: {listen: 127.0.0.1:1}\nhttp: {listen: 127.0.0.1:1}\n"),
              "127.0.0.1:1");
}

TEST(ListenInText, AByteOrderMarkIsSkipped) {
    EXPECT_EQ(http_listen_in("\xEF\xBB\xBFhttp: {listen: 127.0.0.1:1}\n["), "127.0.0.1:1");
}

}  // namespace
}  // namespace panelgate::app::listen_in_text_test
