// Who we are to the gateway. The token is kept for this tab alone.
import {Refused, forgetToken, gateway, hasToken, useToken} from './api.js';
import {dialog, refusal} from './confirm.js';
import {attribute, h, replace, text} from './dom.js';
import {t, word} from './language.js';

/** Asks for a token; ends when there is one, or nobody wants to give one. */
export function askToken() {
    return new Promise((resolve) => {
        const input = h('input', {id: 'token', type: 'password', autocomplete: 'off', required: !hasToken()});
        const outcome = h('div');
        const form = h('form', {method: 'dialog'}, h('p', {class: 'muted'}, t('token.hint')), h('label', {for: 'token'}, t('token')), input, outcome,
            h('div', {class: 'bar end'}, hasToken() ? h('button', {type: 'button', onclick: forgetToken}, t('token.forget')) : null,
                h('button', {type: 'button', onclick: () => node.close()}, t('cancel')), h('button', {class: 'primary'}, t('token.use'))));
        const take = async (given) => {
            try {
                await useToken(given.trim());
                document.dispatchEvent(new Event('role'));
                node.close();
            } catch (error) {
                replace(outcome, error instanceof Refused && error.status === 401 ? h('p', {class: 'refusal', role: 'alert'}, t('token.unknown')) : refusal(error));
            }
        };
        form.addEventListener('submit', (event) => { event.preventDefault(); take(input.value); });
        const node = dialog(t('token.enter'), form);
        node.addEventListener('close', resolve);
    });
}

/** The button that says who we are. */
export function roleButton() {
    const node = h('button', {type: 'button', class: 'quiet', id: 'role', onclick: askToken});
    const show = () => {
        text(node, word('role', gateway.role));
        for (const name of ['aria-label', 'title']) attribute(node, name, t('role', {role: word('role', gateway.role)}));
    };
    document.addEventListener('role', show);
    show();
    return node;
}
