/** Splits a finding of the server's check, `file: element: problem; valid: valid values`, into its parts. */

export interface Finding {
  file: string | null;
  element: string | null;
  text: string;
  valid: string | null;
}

const FILE = /^([^\s:]+\.(?:zip(?:\/[^:]+)?|urdf|toml|stl)): /;
const ELEMENT = /^((?:[\w. -]+ )?'[^']*'|\[+[^\]]+\]+[\w. ]*|[\w.]+): /;
const VALID = /; (valid: .*|the limit is .*)$/s;
const UNUSUAL = 'beyond the program\u2019s hands: ';

/** Splits one message; a message in another form stays in one piece. */
export function finding(message: string): Finding {
  let text = message.trim().replace(/^beyond the program's hands: /, '');
  const unusual = text.length < message.trim().length;
  let file: string | null = null;
  let element: string | null = null;
  let valid: string | null = null;
  const named = FILE.exec(text);
  if (named) {
    file = named[1] ?? null;
    text = text.slice(named[0].length);
    const about = ELEMENT.exec(text);
    if (about) {
      element = about[1] ?? null;
      text = text.slice(about[0].length);
    }
  }
  const values = VALID.exec(text);
  if (values) {
    valid = values[1] ?? null;
    text = text.slice(0, values.index);
  }
  return { file, element, text: unusual ? UNUSUAL + text : text, valid };
}

/** Splits a refusal, which may have several messages, one a line. */
export function findings(detail: string): Finding[] {
  return detail
    .split('\n')
    .filter((line) => line.trim() !== '')
    .map(finding);
}
