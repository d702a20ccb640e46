// npm_client.js LIBRARY HOST PORT: a client of modbus-serial, jsmodbus, modbus-stream or h5.modbus with
// its own defaults. It speaks the lines of plain_clients.py.
"use strict";
const fs = require("fs");
const net = require("net");
const path = require("path");
const readline = require("readline");

class Refused extends Error {}
const bits = (values, count) => Array.from(values).slice(0, count).map(Number);
const words = (buffer) => Array.from({ length: buffer.length / 2 }, (_, i) => buffer.readUInt16BE(2 * i));
const bytes = (values) => Buffer.concat(values.map((v) => Buffer.from([v >> 8, v & 0xff])));
const isBits = (table) => table === "coils" || table === "discrete";

// Each: connect(host, port) -> { read, set, write }(table, unit, address, count or value or values)
const libraries = {
    "modbus-serial": async (host, port) => {
        const Client = require("modbus-serial");
        const client = new Client();
        await client.connectTCP(host, { port });
        const guarded = (unit, call) => {
            client.setID(unit);
            return call().catch((e) => { throw e.modbusCode ? new Refused(e.modbusCode) : e; });
        };
        const reads = { coils: "readCoils", discrete: "readDiscreteInputs",
                        holding: "readHoldingRegisters", inputs: "readInputRegisters" };
        return {
            read: async (table, unit, address, count) => {
                const { data } = await guarded(unit, () => client[reads[table]](address, count));
                return isBits(table) ? bits(data, count) : data;
            },
            set: (table, unit, address, value) => guarded(unit, () => table === "coils"
                ? client.writeCoil(address, Boolean(value)) : client.writeRegister(address, value)),
            write: (table, unit, address, values) => guarded(unit, () => table === "coils"
                ? client.writeCoils(address, values.map(Boolean)) : client.writeRegisters(address, values)),
        };
    },

    jsmodbus: async (host, port) => {
        const { client: { TCP } } = require("jsmodbus");
        const units = new Map();
        const of = async (unit) => {  // its clients have one unit and a socket each
            if (!units.has(unit)) {
                const socket = net.connect(port, host);
                units.set(unit, new TCP(socket, unit));
                await new Promise((done) => { socket.once("connect", done); });
            }
            return units.get(unit);
        };
        const guarded = async (unit, call) => {
            try {
                return (await call(await of(unit))).response.body;
            } catch (e) {
                throw e.response?.body?.code ? new Refused(e.response.body.code) : new Error(e.message || e.err);
            }
        };
        const reads = { coils: "readCoils", discrete: "readDiscreteInputs",
                        holding: "readHoldingRegisters", inputs: "readInputRegisters" };
        return {
            read: async (table, unit, address, count) => {
                const { valuesAsArray } = await guarded(unit, (c) => c[reads[table]](address, count));
                return isBits(table) ? bits(valuesAsArray, count) : Array.from(valuesAsArray);
            },
            set: (table, unit, address, value) => guarded(unit, (c) => table === "coils"
                ? c.writeSingleCoil(address, Boolean(value)) : c.writeSingleRegister(address, value)),
            write: (table, unit, address, values) => guarded(unit, (c) => table === "coils"
                ? c.writeMultipleCoils(address, values.map(Boolean)) : c.writeMultipleRegisters(address, values)),
        };
    },

    "modbus-stream": async (host, port) => {
        const modbus = require("modbus-stream");
        const client = await new Promise((done, failed) => modbus.tcp.connect(
            port, host, { debug: null }, (e, connection) => { e ? failed(e) : done(connection); }));
        const names = { IllegalFunction: 1, IllegalDataAddress: 2, IllegalDataValue: 3 };
        const ask = (call, unit, options) => new Promise((done, failed) => client[call](
            { ...options, extra: { unitId: unit } }, (e, answer) => {
                if (!e) return done(answer.response.data);
                return failed(names[e.message] ? new Refused(names[e.message]) : e);
            }));
        const reads = { coils: "readCoils", discrete: "readDiscreteInputs",
                        holding: "readHoldingRegisters", inputs: "readInputRegisters" };
        return {
            read: async (table, unit, address, quantity) => {
                const data = await ask(reads[table], unit, { address, quantity });
                return isBits(table) ? bits(data, quantity) : data.map((b) => b.readUInt16BE(0));
            },
            set: (table, unit, address, value) => table === "coils"
                ? ask("writeSingleCoil", unit, { address, value })
                : ask("writeSingleRegister", unit, { address, value: bytes([value]) }),
            write: (table, unit, address, values) => table === "coils"
                ? ask("writeMultipleCoils", unit, { address, values })
                : ask("writeMultipleRegisters", unit, { address, values: values.map((v) => bytes([v])) }),
        };
    },

    "h5.modbus": async (host, port) => {
        const master = require("h5.modbus").createMaster({
            transport: { type: "ip", connection: { type: "tcp", host, port } } });
        await new Promise((done) => { master.once("connected", done); });
        const ask = (call, unit, ...rest) => new Promise((done, failed) => master[call](...rest, {
            unit,
            onError: failed,
            onResponse: (r) => { r.isException() ? failed(new Refused(r.getExceptionCode())) : done(r); },
        }));
        const reads = { coils: "readCoils", discrete: "readDiscreteInputs",
                        holding: "readHoldingRegisters", inputs: "readInputRegisters" };
        return {
            read: async (table, unit, address, count) => {
                const reply = await ask(reads[table], unit, address, count);
                return isBits(table) ? bits(reply.getStates(), count) : words(reply.getValues());
            },
            set: (table, unit, address, value) => table === "coils"
                ? ask("writeSingleCoil", unit, address, Boolean(value))
                : ask("writeSingleRegister", unit, address, value),
            write: (table, unit, address, values) => table === "coils"
                ? ask("writeMultipleCoils", unit, address, values.map(Boolean))
                : ask("writeMultipleRegisters", unit, address, bytes(values)),
        };
    },
};

function version(library) {
    const folder = process.env.NODE_PATH.split(path.delimiter).find((f) => fs.existsSync(path.join(f, library)));
    return JSON.parse(fs.readFileSync(path.join(folder, library, "package.json"), "utf8")).version;
}

async function answer(client, line) {
    const [verb, table, unit, address, ...values] = line.split(" ").map((w, i) => (i < 2 ? w : Number(w)));
    try {
        const came = await client[verb](table, unit, address, verb === "write" ? values : values[0]);
        return verb === "read" ? ["ok", ...came].join(" ") : "ok";
    } catch (e) {
        return e instanceof Refused ? `exception ${e.message}` : `error ${e.message || e}`;
    }
}

async function main(library, host, port) {
    const client = await libraries[library](host, Number(port));
    console.log(`ready ${version(library)}`);
    for await (const line of readline.createInterface({ input: process.stdin })) {
        console.log(await answer(client, line));
    }
    process.exit(0);
}

main(...process.argv.slice(2)).catch((e) => { console.error(e); process.exit(69); });
