// Secrets that a slip has made a part of something else are in no message.
#include <gtest/gtest.h>

#include <string>

#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config {
namespace {

constexpr const char* kStart = "lines: [{name: a, device: sim}]\n";

std::string faults(const std::string& text) {
    yaml::Problems problems("f.yaml");
    EXPECT_FALSE(load(kStart + text, MemoryFiles({}), problems)) << text;
    return problems.text();
}

TEST(Secrets, ASecretWithASlipIsInNoMessage) {
    for (const std::string slip :
         {"password:hunter22", "password = hunter22", "password=hunter22", "password : \"hunter22",
          "password: %hunter22", "password: *hunter22", "password: @hunter22",
          "password: hunter22: X", "Password:hunter22", "passwd: hunter22", "pass: [hunter22",
          "token: hunter22", "secret:hunter22"}) {
        const std::string text =
            faults("mqtt:\n  broker: mqtt://b:1883\n  username: u\n  " + slip + "\n");
        EXPECT_EQ(text.find("hunter22"), std::string::npos) << text;
        EXPECT_NE(text.find("f.yaml:"), std::string::npos) << text;
    }
    const std::string flow = faults(
        "http: {listen: \"127.0.0.1:0\", tokens: [{token:hunter22, name: o, role: admn}]}\n");
    EXPECT_EQ(flow.find("hunter22"), std::string::npos) << flow;
    EXPECT_NE(flow.find("admn"), std::string::npos) << flow;
}

TEST(Secrets, WhatIsNoSecretIsTold) {
    const std::string rule =
        faults("access: {rules: [{name: a, deny: [write], tokens: [nobody-has-it]}]}\n");
    EXPECT_NE(rule.find("nobody-has-it"), std::string::npos) << rule;
    const std::string tag = faults("mqtt: {broker: !secret broker-of-all}\n");
    EXPECT_EQ(tag.find("***"), std::string::npos) << tag;
}

}  // namespace
}  // namespace panelgate::config
