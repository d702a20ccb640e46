// Looks for stations that nobody has listed, on a line that runs.
import {gateway, get, mayConfigure, mayDiscover, path, post, remove} from './api.js';
import {insert} from './configuration_draft.js';
import {refusal} from './confirm.js';
import {choice, h, replace, table, text} from './dom.js';
import {duration, t} from './language.js';
import {live} from './live.js';
import {askToken} from './token.js';

const FRESH = 2000;  // ms: how long the time left is shown before it is asked anew

/** A list of addresses that may wrap: "5, 17, 20-31". */
const spaced = (stations) => stations.replaceAll(',', ', ');

class Discovery {
    constructor(line) {
        this.line = line;
        this.stations = h('input', {id: 'stations', value: '1-247', autocomplete: 'off'});
        this.share = h('input', {id: 'share', type: 'number', min: 1, max: 50, value: 10});
        this.start = h('button', {class: 'primary'}, t('discovery.start'));
        this.end = h('button', {type: 'button', hidden: true, onclick: () => this.#stop()}, t('discovery.stop'));
        this.progress = h('progress', {hidden: true, 'aria-label': t('nav.discovery')});
        this.said = h('p', {class: 'muted', role: 'status'});
        this.addresses = h('p', {class: 'muted addresses'});
        this.result = h('div');
        this.node = h('div', null, h('section', {class: 'card'}, h('p', {class: 'muted'}, t('discovery.hint')), this.#form(), this.progress, this.said, this.addresses), this.result);
        this.told = ({detail}) => {
            if (detail.line !== line) return;
            this.#goes(detail);
            if (detail.state !== 'running' || performance.now() - this.looked > FRESH) this.#ask();
        };
        live.addEventListener('discovery', this.told);
        this.#ask();
    }

    stop() { live.removeEventListener('discovery', this.told); }

    /** How far it is, and what was found, also where others have begun it. */
    #ask() {
        if (gateway.configuration.partial) return;  // it is about all stations
        this.looked = performance.now();
        get(path('lines', this.line, 'discover')).then((report) => this.#show(report), () => {});
    }

    #form() {
        if (!mayDiscover()) {
            return h('div', null, h('p', null, t('role.engineer.needed')), h('button', {type: 'button', onclick: askToken}, t('token.enter')));
        }
        return h('form', {class: 'request three', onsubmit: (event) => { event.preventDefault(); this.#look(); }},
            h('label', null, h('span', null, t('discovery.stations')), this.stations),
            h('label', null, h('span', null, t('discovery.share')), this.share), this.start, this.end);
    }

    #goes({state, asked, of, found, refused = this.refused ?? 0, remaining_ms = this.left}) {
        Object.assign(this, {refused, left: remaining_ms});
        Object.assign(this.progress, {hidden: false, max: of, value: asked});
        const parts = [t('discovery.progress', {asked, of, found})];
        if (refused > 0) parts.push(t('discovery.refused', {refused}));
        this.end.hidden = state !== 'running';
        if (state === 'running' && remaining_ms !== undefined) parts.push(t('discovery.left', {time: duration(remaining_ms)}));
        text(this.said, parts.join(', '));
    }

    /** Who was really asked, and who of these was silent. */
    #names({asked_stations, silent_stations}) {
        const parts = [];
        if (asked_stations) parts.push(t('discovery.asked', {stations: spaced(asked_stations)}));
        if (silent_stations) parts.push(t('discovery.silent', {stations: spaced(silent_stations)}));
        text(this.addresses, parts.join(' · '));
    }

    #stop() { remove(path('lines', this.line, 'discover')).then((report) => this.#show(report), (error) => replace(this.result, refusal(error))); }

    async #look() {
        this.start.disabled = true;
        Object.assign(this, {refused: 0, left: undefined});
        replace(this.result);
        try {
            this.#show(await post(path('lines', this.line, 'discover'), {stations: this.stations.value, share_percent: Number(this.share.value)}));
        } catch (error) {
            replace(this.result, refusal(error));
        }
        this.start.disabled = false;
    }

    /** Puts a station into the text of the configuration, and shows it there. */
    #adder({id, profiles: [profile]}) {
        if (!mayConfigure()) return null;
        const item = {id, name: `${this.line}-${id}`, ...profile && {profile}};
        const add = () => insert(`lines/${this.line}/stations`, item).catch((error) => replace(this.result, refusal(error)));
        return h('td', null, h('button', {type: 'button', class: 'add', onclick: add}, t('text.add.station')));
    }

    #show(report) {
        if (report.state === 'never') return text(this.said, t('discovery.never'));
        this.#goes(report);
        this.#names(report);
        if (report.state === 'running') return null;
        this.progress.hidden = true;
        if (report.stations.length === 0) return replace(this.result, h('p', {class: 'empty'}, t('discovery.none')));
        const shown = table(t('nav.discovery'), [[t('id'), 'number'], [t('profile')], [t('discovery.evidence')], ...mayConfigure() ? [['']] : []]);
        shown.body.append(...report.stations.map((one) => h('tr', null, h('td', {class: 'number'}, String(one.id)),
            h('td', null, one.profiles.join(', ') || t('no.profile')), h('td', {lang: 'en'}, [one.evidence].flat().join('; ')), this.#adder(one))));
        return replace(this.result, shown.node, h('section', {class: 'card'}, h('h2', null, t('discovery.paste')),
            h('pre', {class: 'yaml', tabindex: 0, 'aria-label': 'YAML', role: 'region'}, report.yaml)));
    }
}

export function discoveryView({argument}) {
    const line = argument ?? live.lines[0]?.name;
    if (!live.line(line)) return {node: h('p', {class: 'empty'}, t('no.lines'))};
    const discovery = new Discovery(line);
    const chooser = live.lines.length < 2 ? null : choice(t('line'), live.lines.map((one) => [one.name, one.name]), line, (chosen) => { location.hash = `#/discovery/${chosen}`; });
    return {node: h('div', null, h('h1', null, t('nav.discovery'), ' ', h('small', null, line)), chooser, discovery.node), stop: () => discovery.stop()};
}
