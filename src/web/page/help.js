// Where the manual, which the same gateway serves, explains what is shown.
import {attribute, h} from './dom.js';
import {t} from './language.js';

const DASHBOARD = 'operate/dashboard.html';
const EXCEPTIONS = 'trouble/exceptions.html';
const OF_EXCEPTION = {6: '#06-busy', 10: '#0a-no-way-there', 11: '#0b-no-answer'};
const OF_STATUS = {401: true, 403: true, 421: true};
const MANUAL = 'docs/';

/** A link to a page of the manual, which is in English; `about` is what a screen reader hears besides. */
export function explained(page, about, shown = t('help.more')) {
    return h('a', {class: 'explained', href: MANUAL + page, hreflang: 'en', 'aria-label': `${shown}: ${about}`}, shown);
}

export const findingPage = (cause) => `reference/findings.html#${cause}`;
export const exceptionPage = (code) => EXCEPTIONS + (OF_EXCEPTION[code] ?? '');

/** Of a refused request: the page that tells what to do, or null. */
export function problemPage({status, modbus_exception: exception}) {
    if (exception) return exceptionPage(exception);
    return OF_STATUS[status] ? 'trouble/index.html#http-401-403-421' : null;
}

/** The "?" beside the tools: {node, update(view)}. A view's section of the page bears its name in the address. */
export function helpLink() {
    const node = h('a', {id: 'help', class: 'button', hreflang: 'en', href: MANUAL + DASHBOARD}, '?');
    return {node, update: (view, name) => {
        attribute(node, 'href', MANUAL + (view === null ? 'tasks/tokens.html' : `${DASHBOARD}#${view}`));
        for (const label of ['aria-label', 'title']) attribute(node, label, t('help', {about: name}));
    }};
}
