// The pure parts of the dashboard: node --test tests/page
import assert from 'node:assert/strict';
import test from 'node:test';
import {explain, hex, valuesOf} from '../../src/web/page/frame.js';
import {Timeline, bytesOf, characterTime, latency, plotted} from '../../src/web/page/timeline.js';

const CHARACTER = 0.001;
const frame = (sequence, at, direction, bytes, note) =>
    ({sequence, at, time: new Date(at * 1000).toISOString(), direction, station: bytesOf(bytes)[0], bytes, note});
const request = (sequence, at, bytes = '1F 03 00 64 00 02 06 6A') => frame(sequence, at, 'sent', bytes, 'request');
const reply = (sequence, at, bytes = '1F 03 04 00 0A 00 14 AA AA') => frame(sequence, at, 'received', bytes, 'reply');
const timeline = (frames, decisions = []) => {
    const made = new Timeline(CHARACTER);
    made.add({frames, decisions});
    return made;
};
const near = (a, b) => assert.ok(Math.abs(a - b) < 1e-6, `${a} is not ${b}`);

test('a character has start, data, parity and stop bits', () => {
    near(characterTime('38400 8N1'), 10 / 38400);
    near(characterTime('19200 8E1'), 11 / 19200);
    near(characterTime(undefined), 11 / 19200);
});

test('a request is on the wire from its first bit on, a reply until its last byte', () => {
    const {segments} = timeline([request(1, 10), reply(2, 10.03)]);
    near(segments[0].to, 10.008);
    near(segments[1].from, 10.021);
    near(segments[1].to, 10.03);
});

test('between request and reply the panel thinks', () => {
    const made = timeline([request(1, 10), reply(2, 10.03), request(3, 10.035)]);
    const [exchange] = made.exchanges;
    near(exchange.think, 13);
    near(exchange.wire, 17);
    near(exchange.total, 30);
    assert.equal(exchange.failed, false);
    assert.deepEqual(made.between(10, 11).map((span) => span.kind).sort(), ['gap', 'silence', 'think']);
});

test('a request without a reply is silence until the next', () => {
    const made = timeline([request(1, 10), request(2, 10.5, '05 03 00 00 00 01 85 8E'), reply(3, 10.52, '05 03 02 00 07 AA AA')]);
    const silence = made.between(10, 11).find((span) => span.kind === 'silence');
    near(silence.from, 10.008);
    near(silence.to, 10.5);
    assert.equal(made.exchanges[0].failed, true);
    assert.equal(latency(made.exchanges).answered, 1);
});

test('a quarantine is drawn for as long as it was decided', () => {
    const made = timeline([request(1, 10)], [{sequence: 2, at: 10.6, time: '2026-01-01T00:00:00Z',
        text: 'only this request is sent for 512.0 ms: station 31 did not answer and may do so late'}]);
    const rest = made.between(10, 12).find((span) => span.kind === 'rest');
    near(rest.to - rest.from, 0.512);
    assert.equal(rest.station, 31);
});

test('the oldest give way', () => {
    const made = new Timeline(CHARACTER, 3);
    for (let i = 1; i <= 10; ++i) made.add({frames: [request(i, i)], decisions: []});
    assert.deepEqual(made.segments.map((one) => one.sequence), [8, 9, 10]);
    assert.equal(made.seen(8.5, 9.5).length, 1);
});

test('a reply is explained with what was asked', () => {
    const asked = explain(bytesOf('1F 03 00 64 00 02 06 6A'), false);
    assert.deepEqual([asked.station, asked.code, asked.address, asked.count], [31, 3, 100, 2]);
    const said = explain(bytesOf('1F 03 04 00 0A 00 14 AA AA'), true, asked);
    assert.deepEqual([said.address, said.values], [100, [10, 20]]);
    assert.deepEqual(said.fields.map((field) => field.kind), ['station', 'function', 'byte-count', 'values', 'crc']);
});

test('bits are as many as were asked for, the lowest first', () => {
    const asked = explain(bytesOf('1F 01 01 20 00 05 FF FF'), false);
    const said = explain(bytesOf('1F 01 01 19 AA AA'), true, asked);
    assert.deepEqual(said.values, [1, 0, 0, 1, 1]);
    assert.deepEqual(valuesOf([0xCD, 0x01], 'coils', 10), [1, 0, 1, 1, 0, 0, 1, 1, 1, 0]);
});

test('an exception, a write and a frame of another function are explained, too', () => {
    assert.equal(explain(bytesOf('1F 83 02 AA AA'), true).exception, 2);
    assert.deepEqual(explain(bytesOf('1F 10 00 64 00 02 04 00 05 00 06 AA AA'), false).values, [5, 6]);
    assert.deepEqual(explain(bytesOf('1F 05 00 64 FF 00 AA AA'), false).values, [1]);
    assert.equal(explain(bytesOf('1F 2B 0E 01 00 AA AA'), false).fields[2].value, '0E 01 00');
});

test('what was cut short is explained as far as it goes', () => {
    for (let length = 0; length < 13; ++length) {
        const bytes = bytesOf('1F 10 00 64 00 02 04 00 05 00 06 AA AA').slice(0, length);
        const fields = explain(bytes, false).fields.flatMap((field) => field.bytes);
        assert.equal(hex(fields), hex(bytes));
    }
});

test('a transaction that is over has better instants than the frames, and its queue', () => {
    const made = timeline([request(1, 10), reply(2, 10.03)]);
    made.add({frames: [], decisions: [], transactions: [{sequence: 1, outcome: 'ok', client: 'http 127.0.0.1', arrived: 9.95,
        first_bit_out: 10, last_bit_out: 10.009, first_byte_in: 10.019}]});
    const [exchange] = made.exchanges;
    near(exchange.queue, 50);
    near(exchange.think, 10);
    near(exchange.wire, 9 + 11);
    near(exchange.total, 80);
    assert.equal(exchange.client, 'http 127.0.0.1');
    assert.equal(latency(made.exchanges).queue.mean !== null, true);
});

test('what nobody knows is no zero', () => {
    assert.equal(latency(timeline([request(1, 10), reply(2, 10.03)]).exchanges).queue.mean, null);
    assert.equal(latency([]).total.mean, null);
});

test('a plot has a gap and a tick where nobody answered, and nothing of what is not over', () => {
    const made = timeline([request(1, 10), reply(2, 10.03), request(3, 11), request(4, 12), reply(5, 12.03), request(6, 13)]);
    const {rows, failed} = plotted(made.of(31), made.waiting);
    assert.deepEqual(rows.map(([at]) => at), [10000, 11000, 12000]);
    assert.deepEqual(rows.map(([, , wire]) => wire === null), [false, true, false]);
    assert.deepEqual(failed, [11000]);
    made.add({frames: [], decisions: [], transactions: [{sequence: 6, outcome: 'timeout', client: null, arrived: 13, first_bit_out: 13,
        last_bit_out: 13.008, first_byte_in: null}]});
    assert.deepEqual(plotted(made.of(31), made.waiting).failed, [11000, 13000], 'now it is over');
});

test('a refusal was measured and failed all the same; broadcasts fail nobody', () => {
    const made = timeline([request(1, 10), reply(2, 10.03, '1F 83 02 AA AA'), request(3, 11, '00 05 00 01 FF 00 AA AA'), request(4, 12), reply(5, 12.03)]);
    const {rows, failed} = plotted(made.exchanges, made.waiting);
    assert.deepEqual([rows.length, failed], [2, [10000]]);
    assert.ok(rows[0][2] > 0);
});
