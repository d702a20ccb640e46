// Server-sent events: node --test tests/page
import assert from 'node:assert/strict';
import test from 'node:test';
import {EventText} from '../../src/web/page/event_text.js';

const STREAM = ': hello\n\nid: 1\nevent: point\ndata: {"value":1}\n\nevent: line\ndata: a\ndata: b\n\ndata: c\n\n';
const TOLD = [{type: 'point', data: '{"value":1}'}, {type: 'line', data: 'a\nb'}, {type: 'message', data: 'c'}];

test('events are told once they are whole, wherever the stream is cut', () => {
    for (let at = 0; at <= STREAM.length; ++at) {
        const text = new EventText();
        assert.deepEqual([...text.add(STREAM.slice(0, at)), ...text.add(STREAM.slice(at))], TOLD, `cut at ${at}`);
    }
});

test('what is not whole is not told', () => {
    assert.deepEqual(new EventText().add('event: point\ndata: 1\n'), []);
});
