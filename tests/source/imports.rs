//! The imports between modules of a crate.
//!
//! An import is a path that begins with `crate`, `self`, `super` or a child module. It leads to the deepest module on it,
//! also where that module re-exports the name. Modules in braces belong to their file. Imports for tests alone do not
//! count: items under `#[cfg(test)]` and modules named `tests`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// Segments of a path, from the root of the crate.
pub(crate) type Segments = Vec<String>;

/// The modules of a crate that have a file of their own, each with the modules that it imports.
pub(crate) fn read(root: &Path) -> BTreeMap<Segments, BTreeSet<Segments>> {
    let mut reader = Reader::default();
    reader.read_file(root, root.parent().expect("a file is in a folder"), vec![]);
    let mut imports: BTreeMap<_, _> =
        reader.files.iter().map(|file| (file.clone(), BTreeSet::new())).collect();
    for Written { file, module, path } in &reader.written {
        if let Some(to) = reader.resolve(module, path).filter(|to| to != file) {
            imports.entry(file.clone()).or_default().insert(to);
        }
    }
    imports
}

#[derive(Default)]
struct Reader {
    /// Modules with a file of their own.
    files: BTreeSet<Segments>,
    /// All modules, each with the one whose file it is in.
    modules: BTreeMap<Segments, Segments>,
    written: Vec<Written>,
}

/// A path as a module writes it.
struct Written {
    file: Segments,
    module: Segments,
    path: Segments,
}

impl Reader {
    /// Reads the file of a module; `below` is the folder of its child modules.
    fn read_file(&mut self, file: &Path, below: &Path, module: Segments) {
        let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let tokens: TokenStream = text.parse().unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        self.files.insert(module.clone());
        self.modules.insert(module.clone(), module.clone());
        self.walk(tokens, &module.clone(), &module, below);
    }

    /// Collects the modules and paths in a piece of a module's text.
    fn walk(&mut self, tokens: TokenStream, file: &Segments, module: &Segments, below: &Path) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut i = 0;
        while i < tokens.len() {
            let text = word(tokens.get(i));
            match &tokens[i] {
                TokenTree::Punct(p) if p.as_char() == '#' => {
                    let inner = usize::from(is(tokens.get(i + 1), '!'));
                    let for_tests = tokens.get(i + 1 + inner).is_some_and(is_for_tests);
                    if for_tests && inner == 1 {
                        return;
                    }
                    i += 2 + inner;
                    if for_tests {
                        i += item_length(&tokens[i..]);
                    }
                }
                TokenTree::Group(group) => {
                    self.walk(group.stream(), file, module, below);
                    i += 1;
                }
                _ if text == "pub" && tokens.get(i + 1).is_some_and(is_restriction) => i += 2,
                _ if text == "mod" && !word(tokens.get(i + 1)).is_empty() => {
                    let name = word(tokens.get(i + 1));
                    let child = [&module[..], std::slice::from_ref(&name)].concat();
                    match tokens.get(i + 2) {
                        Some(TokenTree::Group(group)) => {
                            self.modules.insert(child.clone(), file.clone());
                            self.walk(group.stream(), file, &child, &below.join(name));
                        }
                        _ if name != "tests" => self.read_declared(&name, child, below),
                        _ => {}
                    }
                    i += 3;
                }
                _ if text == "use" => {
                    let end = (i..tokens.len()).find(|&k| is(tokens.get(k), ';')).unwrap_or(tokens.len());
                    for path in used(&tokens[i + 1..end], &[]) {
                        self.written.push(Written { file: file.clone(), module: module.clone(), path });
                    }
                    i = end;
                }
                _ if !text.is_empty() && !is_inside_path(&tokens[..i]) => {
                    let mut path = vec![text];
                    i += 1;
                    while is(tokens.get(i), ':')
                        && is(tokens.get(i + 1), ':')
                        && !word(tokens.get(i + 2)).is_empty()
                    {
                        path.push(word(tokens.get(i + 2)));
                        i += 3;
                    }
                    if path.len() > 1 {
                        self.written.push(Written { file: file.clone(), module: module.clone(), path });
                    }
                }
                _ => i += 1,
            }
        }
    }

    /// Reads the file of `mod name;`.
    fn read_declared(&mut self, name: &str, child: Segments, below: &Path) {
        let folder = below.join(name);
        let files = [below.join(format!("{name}.rs")), folder.join("mod.rs")];
        if let Some(file) = files.iter().find(|file| file.is_file()) {
            self.read_file(file, &folder, child);
        }
    }

    /// The module to whose file a path leads, if it leads into this crate.
    fn resolve(&self, module: &Segments, path: &[String]) -> Option<Segments> {
        let child = |of: &Segments, name: &String| {
            let child = [&of[..], std::slice::from_ref(name)].concat();
            self.modules.contains_key(&child).then_some(child)
        };
        let above = |of: &Segments| of.split_last().map(|(_, above)| above.to_vec());
        let mut at = match path.first()?.as_str() {
            "crate" => vec![],
            "self" => module.clone(),
            "super" => above(module)?,
            _ => child(module, &path[0])?,
        };
        for segment in &path[1..] {
            at = match segment.as_str() {
                "self" => at,
                "super" => above(&at)?,
                _ => match child(&at, segment) {
                    Some(deeper) => deeper,
                    None => break,
                },
            };
        }
        self.modules.get(&at).cloned()
    }
}

/// The paths of a `use`: `a::b`, `a::{b, c::d}`, `a::b as c`, `a::*`.
fn used(tokens: &[TokenTree], before: &[String]) -> Vec<Segments> {
    let mut paths = Vec::new();
    for tree in tokens.split(|token| is(Some(token), ',')) {
        let mut path = before.to_vec();
        for token in tree {
            match token {
                TokenTree::Group(group) => {
                    let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                    paths.extend(used(&inner, &path));
                    path.clear();
                }
                TokenTree::Ident(ident) if ident == "as" => break,
                TokenTree::Ident(ident) => path.push(ident.to_string()),
                _ => {}
            }
        }
        paths.extend((!path.is_empty()).then_some(path));
    }
    paths
}

/// The text of a word; empty for anything else.
fn word(token: Option<&TokenTree>) -> String {
    match token {
        Some(TokenTree::Ident(ident)) => ident.to_string(),
        _ => String::new(),
    }
}

fn is(token: Option<&TokenTree>, sign: char) -> bool {
    matches!(token, Some(TokenTree::Punct(p)) if p.as_char() == sign)
}

/// Whether a word after these tokens continues a path or a method call, or names a lifetime.
fn is_inside_path(tokens: &[TokenTree]) -> bool {
    let [.., before, last] = tokens else { return false };
    match last {
        TokenTree::Punct(p) if p.as_char() == '.' => !is(Some(before), '.'),
        TokenTree::Punct(p) if p.as_char() == ':' => is(Some(before), ':'),
        _ => is(Some(last), '\''),
    }
}

/// Whether this is the `(in …)` of `pub(in …)`.
fn is_restriction(token: &TokenTree) -> bool {
    matches!(token, TokenTree::Group(group) if word(group.stream().into_iter().next().as_ref()) == "in")
}

/// Whether an attribute's brackets say `cfg(test)` or `cfg(all(test, …))`.
fn is_for_tests(brackets: &TokenTree) -> bool {
    let text: String = brackets.to_string().split_whitespace().collect();
    text.starts_with("[cfg(test)") || text.starts_with("[cfg(all(test,")
}

/// The number of tokens in an item: up to its first `;` or braces.
fn item_length(tokens: &[TokenTree]) -> usize {
    let is_braces =
        |t: &TokenTree| matches!(t, TokenTree::Group(group) if group.delimiter() == Delimiter::Brace);
    let end = tokens.iter().position(|t| is(Some(t), ';') || is_braces(t));
    end.map_or(tokens.len(), |end| end + 1)
}
