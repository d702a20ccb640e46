// The editor: CodeMirror 5 (MIT), which the gateway serves beside this page.
import {get, path} from './api.js';
import {h} from './dom.js';
import {t} from './language.js';
import {placeAt, propertiesAt, valuesOf} from './yaml_place.js';

const PAUSE = 300;  // ms without a key: then the text is judged
const SCRIPTS = ['page/codemirror.js', 'page/yaml.js', 'page/lint.js', 'page/show-hint.js'];
const STYLES = ['page/codemirror.css', 'page/configuration.css'];

let loaded = null;
let schema = null;

const script = (src) => new Promise((resolve, reject) => document.head.append(h('script', {src, onload: resolve, onerror: reject})));

function library() {
    loaded ??= (async () => {
        document.head.append(...STYLES.map((href) => h('link', {rel: 'stylesheet', href})));
        for (const src of SCRIPTS) await script(src);
        return window.CodeMirror;
    })();
    return loaded;
}

/** What may be typed at the cursor, by the schema of the configuration. */
function hints(editor) {
    const {line, ch} = editor.getCursor();
    const {keys, key, word, from} = placeAt(editor.getValue().split('\n'), line, ch);
    const known = propertiesAt(schema, keys);
    const offered = key === null ? Object.entries(known).map(([name, one]) => ({text: `${name}: `, displayText: name, about: one.description}))
        : valuesOf(schema, known[key] ?? {}).map((value) => ({text: value, displayText: value}));
    const render = (node, _, one) => node.append(h('strong', null, one.displayText), one.about ? h('small', null, ` ${one.about}`) : '');
    return {list: offered.filter((one) => one.displayText.startsWith(word)).map((one) => ({...one, render})), from: {line, ch: from}, to: {line, ch}};
}

export class Editor {
    /** `typed(text)` at each change; `judge(text)`: a promise of problems, asked once nobody types. */
    static async in(box, value, typed, judge) {
        const CodeMirror = await library();
        schema ??= await get(path('configuration', 'schema'));
        return new Editor(CodeMirror, box, value, typed, judge);
    }

    constructor(CodeMirror, box, value, typed, judge) {
        const annotations = (text, update) => judge(text).then((problems) => update(problems.map((one) => this.#mark(one))), () => update([]));
        this.shown = CodeMirror(box, {
            value, mode: 'yaml', lineNumbers: true, lineWrapping: false, indentUnit: 2, tabSize: 2, viewportMargin: 20, screenReaderLabel: t('nav.text'),
            gutters: ['CodeMirror-lint-markers', 'CodeMirror-linenumbers'], lint: {getAnnotations: annotations, async: true, delay: PAUSE, selfContain: true},
            extraKeys: {'Ctrl-Space': 'autocomplete', Tab: false, 'Shift-Tab': false}, hintOptions: {hint: hints, completeSingle: false},
        });
        this.shown.on('change', (editor) => typed(editor.getValue()));
        this.shown.on('inputRead', (editor, {text: [last]}) => { if (/^[a-z]$/.test(last)) editor.showHint(); });
    }

    /** From its place to the end of the word there, or of the line. */
    #mark({line, column, severity, message}) {
        const row = Math.max(line - 1, 0);
        const text = this.shown.getLine(row) ?? '';
        const ch = Math.min(Math.max(column - 1, 0), text.length);
        const length = /^[\w.-]+/.exec(text.slice(ch))?.[0].length ?? text.length - ch;
        return {from: {line: row, ch: length > 0 ? ch : 0}, to: {line: row, ch: ch + Math.max(length, 1)}, severity, message};
    }

    set(value) { this.shown.setValue(value); }

    /** Also where a browser has no clipboard for pages without TLS. */
    copy() {
        this.shown.focus();
        this.shown.execCommand('selectAll');
        document.execCommand('copy');
    }

    judge() { this.shown.performLint(); }

    goTo(line, column = 1) {
        this.shown.focus();
        this.shown.setCursor({line: line - 1, ch: column - 1});
        this.shown.scrollIntoView(null, 120);
        const mark = this.shown.addLineClass(line - 1, 'background', 'arrived');
        setTimeout(() => this.shown.removeLineClass(mark, 'background', 'arrived'), 3000);
    }

    stop() { this.shown.setOption('lint', false); }
}
