// The text of the configuration as somebody changes it, whichever view is shown.
import {getText, path, post, sendText} from './api.js';

const TEXT = path('configuration', 'text');

/** `base`: the file as it was read, with its ETag; `text`: what it shall become; `place`: [line, column] of what was put in, from 1. */
export const draft = {base: null, etag: null, text: '', place: null};

export const isChanged = () => draft.base !== null && draft.text !== draft.base;

/** Reads the file; `fresh` drops what was changed. */
export async function load(fresh = false) {
    if (draft.base !== null && !fresh) return;
    const {text, etag} = await getText(TEXT);
    Object.assign(draft, {base: text, etag, text, place: null});
}

/** What is there now, beside what is changed here. */
export const current = () => getText(TEXT);

/** Judges a text. */
export const check = (text) => sendText('POST', path('configuration', 'check'), text);

/** Writes what was changed; throws Refused, 412 where somebody else was quicker. */
export async function save() {
    const {text} = draft;
    const answer = await sendText('PUT', TEXT, text, {'If-Match': draft.etag});
    Object.assign(draft, {base: text, etag: answer.etag});
    return answer;
}

/** Puts an item into the text, and shows it there. */
export async function insert(into, item) {
    await load();
    const {text, line} = await post(path('configuration', 'insert'), {text: draft.text, into, item});
    let same = 0;
    while (same < draft.text.length && draft.text[same] === text[same]) same++;
    const above = text.slice(0, same).split('\n');
    Object.assign(draft, {text, place: [line, above.length === line ? above.at(-1).length + 1 : 1]});
    location.hash = '#/text';
}

window.addEventListener('beforeunload', (event) => { if (isChanged()) event.preventDefault(); });
