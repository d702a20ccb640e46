// What the view of the configuration file works out without a page: node --test tests/page
import assert from 'node:assert/strict';
import test from 'node:test';
import {difference, excerpt} from '../../src/web/page/text_difference.js';
import {placeAt, propertiesAt, valuesOf} from '../../src/web/page/yaml_place.js';

const kinds = (before, after) => difference(before, after).map(({kind, line}) => `${{same: ' ', gone: '-', come: '+'}[kind]}${line}`);

test('a difference tells what goes and what comes, and is the shortest', () => {
    assert.deepEqual(kinds('a\nb\nc', 'a\nx\nc\nd'), [' a', '-b', '+x', ' c', '+d']);
    assert.deepEqual(kinds('a\nb', 'a\nb'), [' a', ' b']);
    assert.deepEqual(kinds('a\nb\nc\nd', 'b\nd\na'), ['-a', ' b', '-c', ' d', '+a']);
});

test('both texts can be had back from a difference', () => {
    const random = (seed) => () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
    const next = random(49);
    for (let i = 0; i < 200; i++) {
        const made = () => Array.from({length: Math.floor(next() * 12)}, () => 'abc'[Math.floor(next() * 3)]).join('\n');
        const [before, after] = [made(), made()];
        const found = difference(before, after);
        assert.equal(found.filter((one) => one.kind !== 'come').map((one) => one.line).join('\n'), before);
        assert.equal(found.filter((one) => one.kind !== 'gone').map((one) => one.line).join('\n'), after);
    }
});

test('an excerpt leaves out what is far from any change', () => {
    const lines = difference(Array.from({length: 20}, (_, i) => i).join('\n'), Array.from({length: 20}, (_, i) => i === 10 ? 'x' : i).join('\n'));
    assert.deepEqual(excerpt(lines, 1).map((one) => one?.line ?? '…'), ['…', '9', '10', 'x', '11', '…']);
});

const schema = {
    properties: {lines: {type: 'array', items: {$ref: '#/$defs/line'}}, http: {properties: {anonymous: {enum: ['viewer', 'none']}}}},
    $defs: {line: {properties: {name: {}, echo: {enum: ['auto', 'on']}, stations: {items: {oneOf: [{type: 'null'}, {properties: {id: {}, guard: {type: 'boolean'}}}]}}}}},
};
const offered = (text) => {
    const lines = text.split('|')[0].split('\n');
    const {keys, key} = placeAt(lines, lines.length - 1, lines.at(-1).length);
    const known = propertiesAt(schema, keys);
    return key === null ? Object.keys(known) : valuesOf(schema, known[key] ?? {});
};

test('the schema says which keys fit where somebody types', () => {
    assert.deepEqual(offered('|'), ['lines', 'http']);
    assert.deepEqual(offered('lines:\n  - na|'), ['name', 'echo', 'stations']);
    assert.deepEqual(offered('lines:\n  - name: a\n    st|'), ['name', 'echo', 'stations']);
    assert.deepEqual(offered('lines:\n  - name: a\n    stations:\n      - id: 1\n        |'), ['id', 'guard']);
    assert.deepEqual(offered('lines:\n  - name: a\n    stations:\n      - {id: 1, |'), ['id', 'guard']);
    assert.deepEqual(offered('lines:\n  - name: a\n    stations: [{id: 1}, {|'), ['id', 'guard']);
});

test('... and which values', () => {
    assert.deepEqual(offered('http:\n  anonymous: |'), ['viewer', 'none']);
    assert.deepEqual(offered('http: {anonymous: |'), ['viewer', 'none']);
    assert.deepEqual(offered('lines:\n  - name: a\n    echo: |'), ['auto', 'on']);
    assert.deepEqual(offered('lines:\n  - stations:\n      - {id: 1, guard: |'), ['true', 'false']);
});
