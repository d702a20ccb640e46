// What the line doctor and the gateway have found, in the reader's language: made of the finding's cause and figures.
import {h} from './dom.js';
import {explained, findingPage} from './help.js';
import {language, number, said, t} from './language.js';
import {clientName} from './plain_views.js';

/** Causes that concern the whole line, or may; all others without a station are of one that is not listed. */
const OF_LINES = ['echo', 'no-answer-at-all', 'wrong-baud', 'wrong-parity', 'other-master', 'collision', 'overrun', 'noise',
    'tcp-framing', 'trailing-bytes'];

function who({cause, name}) {
    return name ?? t(OF_LINES.includes(cause) ? 'finding.line' : 'finding.unlisted');
}

/** Nothing is damaged: bytes come where none should. */
const isStrays = ({cause, figures}) => cause === 'noise' && 'strays' in figures && !('damaged' in figures);

function textKeys(finding) {
    return isStrays(finding) ? ['noise.strays'] : [finding.cause];
}

/** The keys of its sentences, the best first: the same cause may ask for another advice. */
function adviceKeys({cause, figures}) {
    if (cause !== 'timeout-too-short' || !('deadline_ms' in figures)) return [cause];
    return [`${cause}.${'advised_ms' in figures ? 'deadline' : 'slow'}`];
}

function evidenceKeys({cause, figures}) {
    if (isStrays({cause, figures})) return ['noise.strays'];
    return [cause === 'echo' && 'collided' in figures ? 'echo.none' : cause, 'damaged' in figures ? 'damage' : cause];
}

/** Who asks most, by address; undefined where that is not told. */
const askers = ({clients = []}) => clients.length === 0 ? undefined : clients.map(({name, percent}) => `${clientName(name)} (${number(percent)} %)`).join(', ');

/** {lang, text}: a sentence of the table, or the gateway's own where it has none, or says it in English anyway. */
function sentence(kind, keys, finding, own) {
    const key = keys.map((name) => `${kind}.${name}`).find(said);
    if (language === 'en' || !key) return {lang: 'en', text: own};
    const text = t(key, {...finding.figures, who: who(finding), clients: askers(finding)});
    return /\{\w+\}/.test(text) ? {lang: 'en', text: own} : {lang: language, text};
}

/** What is wrong: {lang, text}. */
export function findingText(finding) {
    return sentence('finding', textKeys({...finding, figures: finding.figures ?? {}}), finding, finding.text);
}

/** What is wrong, what to do, and why that is thought. */
export function findingNote(finding) {
    const known = {...finding, figures: finding.figures ?? {}};
    const wrong = findingText(known);
    const advice = sentence('advice', adviceKeys(known), known, finding.advice);
    const evidence = sentence('evidence', evidenceKeys(known), known, finding.evidence);
    return h('li', {class: 'finding', 'data-cause': finding.cause}, h('strong', {lang: wrong.lang}, wrong.text), ' ',
        h('span', {lang: advice.lang}, advice.text), ' ', explained(findingPage(finding.cause), finding.cause), evidence.text ? h('small', {lang: evidence.lang}, evidence.text) : null);
}
