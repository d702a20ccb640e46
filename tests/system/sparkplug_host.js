// A Sparkplug host of npm's parts (sparkplug-client brings mqtt and sparkplug-payload):
// node sparkplug_host.js PORT. Each message is a line of JSON on stdout; a line on stdin is a
// command: {"topic": "spBv1.0/...", "metrics": [...]}.
const mqtt = require("mqtt");
const payload = require("sparkplug-payload").get("spBv1.0");

const client = mqtt.connect(`mqtt://127.0.0.1:${process.argv[2]}`,
                            {reconnectPeriod: 200, clientId: "host", clean: false});
const plain = (key, value) =>
    value !== null && typeof value === "object" && "unsigned" in value && "low" in value
        ? (value.unsigned ? (value.high >>> 0) * 2 ** 32 + (value.low >>> 0)
                          : value.high * 2 ** 32 + (value.low >>> 0))
        : value;

client.on("connect", () => client.subscribe("spBv1.0/#", {qos: 1}, () => console.log('{"ready": true}')));
client.on("message", (topic, bytes, packet) => {
    const [, group, kind, node, device] = topic.split("/");
    if (kind.endsWith("CMD")) return;
    const told = payload.decodePayload(bytes);
    console.log(JSON.stringify({group, kind, node, device, qos: packet.qos, ...told}, plain));
});
require("readline").createInterface({input: process.stdin}).on("line", (line) => {
    const {topic, metrics} = JSON.parse(line);
    client.publish(topic, payload.encodePayload({timestamp: Date.now(), metrics}));
}).on("close", () => client.end(true, () => process.exit(0)));
