"""What a letter on the page means, where it stands: under the mouse, or at a touch."""

from __future__ import annotations

import json

from .glossary import TERMS

MEANINGS = {word: meaning for words, meaning in TERMS for word in words.split(", ")}
"""Meanings by single letter or word."""

SCRIPT = """(() => {
  if (window.graspViewerTerms) return;
  const MEANINGS = __MEANINGS__;
  const known = (word) => Object.prototype.hasOwnProperty.call(MEANINGS, word);
  const style = document.createElement('style');
  style.textContent = '[data-term] {text-decoration: underline dotted; text-underline-offset: 3px; cursor: help}' +
    '#term-note {position: fixed; left: 50%; bottom: 16px; transform: translateX(-50%); z-index: 9998; width: ' +
    'min(420px, 86vw); padding: 10px 14px; border-radius: 10px; background: #1d2433; color: #fff; ' +
    'font: 14px/1.4 system-ui, sans-serif}';
  document.head.appendChild(style);
  const note = document.createElement('div');
  note.id = 'term-note';
  note.setAttribute('role', 'status');
  note.hidden = true;
  document.body.appendChild(note);
  // The whole text, or else its first word that is a term: "f_n N", "Synergies n_s", "σ1".
  const find = (text) => {
    if (known(text)) return text;
    const words = text.split(/[\\s/,;:·×\\[\\]]+/);
    for (let size = 2; size > 0; size -= 1) {
      for (let i = 0; i + size <= words.length; i += 1) {
        const word = words.slice(i, i + size).join(' ');
        if (known(word)) return word;
        if (known(word.replace(/[0-9]+$/, ''))) return word.replace(/[0-9]+$/, '');
      }
    }
    return '';
  };
  const mark = () => {
    for (const each of document.querySelectorAll('th, label, [data-cell]')) {
      const text = each.textContent.trim();
      if (each.dataset.read === text) continue;
      each.dataset.read = text;
      const term = text.length < 40 ? find(text) : '';
      if (term) {
        each.dataset.term = term;
        each.title = term + ': ' + MEANINGS[term];
      } else if (each.dataset.term) {
        delete each.dataset.term;
        each.removeAttribute('title');
      }
    }
  };
  let hiding = 0;
  document.addEventListener('pointerup', (event) => {
    const touched = event.target.closest && event.target.closest('[data-term]');
    if (event.pointerType !== 'touch') return;
    clearTimeout(hiding);
    note.hidden = !touched;
    if (!touched) return;
    note.textContent = touched.title;
    hiding = setTimeout(() => { note.hidden = true; }, 6000);
  });
  mark();
  window.graspViewerTerms = setInterval(mark, 1000);
})();"""


def glossary_script() -> str:
    """Return the script; it works on exported pages too."""
    return SCRIPT.replace("__MEANINGS__", json.dumps(MEANINGS).replace("</", "<\\/"))
