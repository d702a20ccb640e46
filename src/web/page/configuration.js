// The configuration file: its text with faults as they are typed, what it would change, and what ran before.
import {gateway, get, getText, introduce, path, post} from './api.js';
import {check, current, draft, isChanged, load, save} from './configuration_draft.js';
import {confirm, dialog, refusal} from './confirm.js';
import {h, list, replace, table, text} from './dom.js';
import {Editor} from './editor.js';
import {clockTime, number, t} from './language.js';
import {live} from './live.js';
import {difference, excerpt} from './text_difference.js';

const MARKS = {same: ' ', gone: '−', come: '+'};

/** Two texts beside each other in one: what goes, what comes. */
function differenceView(before, after) {
    const lines = excerpt(difference(before, after));
    if (!lines.some((one) => one && one.kind !== 'same')) return h('p', {class: 'muted'}, t('text.same'));
    return h('pre', {class: 'yaml difference', tabindex: 0, role: 'region', 'aria-label': t('text.difference')},
        lines.map((one) => one === null ? h('span', {class: 'skipped'}, '⋯\n') : h('span', {class: one.kind}, `${MARKS[one.kind]} ${one.line}\n`)));
}

/** "12:3 message", which leads to the place. */
function problemRow(problem, go) {
    const place = problem.line > 0 && !problem.file ? `${problem.line}:${problem.column}` : problem.file ?? '';
    return h('li', {class: `problem ${problem.severity}`}, place && !problem.file ? h('button', {type: 'button', class: 'link', onclick: () => go(problem)}, place) : h('code', null, place),
        ' ', h('span', {lang: 'en'}, problem.message));
}

function changeRow({path: where, kind, before, after, needs}) {
    const said = kind === 'changed' ? `${before ?? '…'} → ${after ?? '…'}` : t('change.' + kind);
    return h('li', null, h('code', null, where), `: ${said}`, needs ? h('small', {class: 'muted', lang: 'en'}, ` (${needs})`) : null);
}

/** What applying a text would interrupt. */
const cutsView = (cuts) => cuts.length === 0 ? null : [h('p', null, t('text.interrupts')), h('ul', {class: 'plain'}, cuts.map((cut) => h('li', null, h('code', null, cut.path), ': ', h('span', {lang: 'en'}, cut.what))))];

class View {
    constructor() {
        this.turn = 0;
        this.faults = 0;
        this.said = h('div', {role: 'status'});
        this.save = h('button', {type: 'button', class: 'primary', id: 'save', disabled: true, onclick: () => this.#save()}, t('text.save'));
        this.drop = h('button', {type: 'button', id: 'drop', disabled: true, onclick: () => this.#drop()}, t('text.drop'));
        this.box = h('div', {class: 'editor', id: 'editor'});
        this.problems = h('ul', {class: 'plain', id: 'problems'});
        this.counted = h('p', {class: 'muted', 'aria-live': 'polite', id: 'counted'});
        this.changes = h('ul', {class: 'plain', id: 'changes'});
        this.plan = h('ul', {class: 'plain', id: 'plan'});
        this.versions = h('div', {id: 'versions'});
        const writable = gateway.text.writable;
        this.node = h('div', null, h('h1', null, t('nav.text')),
            writable ? null : h('p', {class: 'finding', id: 'read-only'}, h('strong', null, t('text.read.only')), ' ', h('span', {lang: 'en'}, gateway.text.why), '. ', t('text.copy')),
            h('div', {class: 'bar'}, writable ? [this.save, this.drop] : h('button', {type: 'button', id: 'copy', onclick: () => this.editor?.copy()}, t('text.copy.now'))), this.said,
            h('div', {class: 'text-columns'}, h('div', null, this.box, h('section', {class: 'card'}, h('h2', null, t('text.problems')), this.counted, this.problems)),
                h('div', null, h('section', {class: 'card'}, h('h2', null, t('text.changes')), this.changes),
                    h('section', {class: 'card'}, h('h2', null, t('text.plan')), this.plan), this.versions)));
        this.#begin();
    }

    stop() { this.editor?.stop(); }

    async #begin() {
        try {
            await load();
            this.editor = await Editor.in(this.box, draft.text, (now) => this.#typed(now), (now) => this.#judge(now));
            if (draft.place) this.editor.goTo(...draft.place);
            draft.place = null;
            this.#typed(draft.text);
            await this.#showVersions();
        } catch (error) {
            replace(this.said, refusal(error));
        }
    }

    #typed(now) {
        draft.text = now;
        this.drop.disabled = !isChanged();
        this.save.disabled = !isChanged() || this.faults > 0;
    }

    /** Asks what is wrong with a text, shows that beside it, and returns it for the marks. */
    async #judge(now) {
        const turn = ++this.turn;
        const found = await check(now);
        if (turn !== this.turn) return [];
        this.found = found;
        this.faults = found.problems.filter((one) => one.severity === 'error').length;
        text(this.counted, this.faults ? t('text.faults', {count: this.faults}) : t('text.valid'));
        this.#typed(now);
        replace(this.problems, found.problems.map((one) => problemRow(one, ({line, column}) => this.editor.goTo(line, column))));
        replace(this.changes, found.valid && found.changes.length === 0 ? h('li', {class: 'muted'}, t('text.same')) : found.changes.map(changeRow),
            found.interruptions.map((cut) => h('li', {class: 'warning'}, h('code', null, cut.path), ': ', h('span', {lang: 'en'}, cut.what))));
        replace(this.plan, (found.plan.lines ?? []).map((line) => h('li', null, h('code', null, line.name), ': ', t('load', {percent: number(line.load_percent, 1)}),
            line.verdict === 'fine' ? null : h('span', {class: 'badge warn', lang: 'en'}, line.verdict))));
        return found.problems.filter((one) => !one.file && one.line > 0);
    }

    async #save() {
        const cuts = this.found?.interruptions ?? [];
        if (cuts.length > 0 && !await confirm(t('text.save'), cutsView(cuts), t('text.save'))) return;
        await this.#done(save);
    }

    /** Shows what came of a text that was to be written. */
    async #done(work) {
        this.save.disabled = true;
        replace(this.said, h('p', {class: 'muted'}, t('asking')));
        try {
            const answer = await work();
            replace(this.said, h('p', {class: 'success'}, t('text.saved', {count: answer.changes.length}),
                answer.restart_needed ? [' ', t('text.restart', {what: answer.restart_needed.join(', ')})] : null));
            await Promise.all([introduce(), live.refresh()]);
            await this.#showVersions();
            this.editor.judge();
        } catch (error) {
            if (error.status === 412) await this.#other();
            else replace(this.said, refusal(error));
        }
        this.#typed(draft.text);
    }

    /** Somebody else has written the file since: shows what, and lets one choose. */
    async #other() {
        const theirs = await current();
        const take = (mine) => () => {
            Object.assign(draft, {base: theirs.text, etag: theirs.etag, text: mine ? draft.text : theirs.text});
            this.editor.set(draft.text);
            replace(this.said, mine ? h('p', {class: 'muted', id: 'kept'}, t('text.kept')) : null);
        };
        replace(this.said, h('section', {class: 'card', id: 'conflict', role: 'alert'}, h('h2', null, t('text.conflict')), h('p', null, t('text.conflict.how')),
            differenceView(theirs.text, draft.text), h('div', {class: 'bar end'},
                h('button', {type: 'button', id: 'take-theirs', onclick: take(false)}, t('text.theirs')),
                h('button', {type: 'button', class: 'danger', id: 'keep-mine', onclick: take(true)}, t('text.mine')))));
    }

    async #drop() {
        if (!await confirm(t('text.drop'), differenceView(draft.text, draft.base), t('text.drop'))) return;
        await load(true);
        this.editor.set(draft.text);
    }

    async #showVersions() {
        const {versions} = await get(path('configuration', 'versions'));
        const shown = table(t('text.versions'), [[''], [t('time')], [t('text.who')]]);
        list(shown.body, versions, (one) => one.version, (one) => ({node: h('tr', {'data-version': one.version},
            h('td', null, h('button', {type: 'button', onclick: () => this.#compare(one.version)}, t('text.compare'))),
            h('td', null, clockTime(Date.parse(one.time))), h('td', {class: 'who', lang: 'en'}, one.who))}));
        replace(this.versions, h('h2', null, t('text.versions')), shown.node);
    }

    /** What a version would change, and the way back to it. */
    async #compare(version) {
        const before = await getText(path('configuration', 'versions', version));
        const back = async () => {
            node.close();
            const {interruptions} = await check(before.text);
            const name = `${t('text.version')} ${version}`;
            if (!await confirm(t('text.back'), [h('p', null, t('text.back.ask', {name})), cutsView(interruptions)], t('text.back'))) return;
            await this.#done(async () => {
                const answer = await post(path('configuration', 'rollback'), {version});
                await load(true);
                this.editor.set(draft.text);
                return answer;
            });
        };
        const node = dialog(`${t('text.version')} ${version}`, differenceView(draft.base, before.text), h('div', {class: 'bar end'},
            h('button', {type: 'button', autofocus: true, onclick: () => node.close()}, t('close')),
            gateway.text.writable ? h('button', {type: 'button', class: 'danger', id: 'roll-back', onclick: back}, t('text.back')) : null));
    }
}

export function configurationView() {
    const view = new View();
    return {node: view.node, stop: () => view.stop()};
}
