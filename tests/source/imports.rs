//! Which files of a crate import which.
//!
//! An import is a path that begins with `crate`, `self`, `super`, a child module or a module that a `use` has named. It
//! leads to the file of the deepest module on it. What only tests see does not count: items under `#[cfg(test)]` and
//! files in a folder `tests`.
//!
//! A name that a module re-exports leads to the file that defines it, unless the importer lies below that module: it is
//! to name its sibling, and its import of the parent, which imports the sibling, may close a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// The imports of the files that belong to one root, `lib.rs` or `main.rs`.
pub(crate) struct Imports {
    /// Paths relative to the folder of the root.
    pub(crate) files: Vec<PathBuf>,
    /// Per file, the files that it imports from.
    pub(crate) of: Vec<BTreeSet<usize>>,
}

impl Imports {
    /// Reads the root and every file that a `mod` below it declares.
    pub(crate) fn read(root: &Path) -> Imports {
        let folder = root.parent().expect("a file lies in a folder");
        let mut tree = Tree::default();
        tree.read_file(root, folder, None);
        let mut of = vec![BTreeSet::new(); tree.files.len()];
        for (module, paths) in tree.modules.iter().map(|m| &m.paths).enumerate() {
            for path in paths {
                let from = tree.modules[module].file;
                if let Some((to, _)) = tree.resolve(module, path, 0)
                    && tree.modules[to].file != from
                {
                    of[from].insert(tree.modules[to].file);
                }
            }
        }
        let relative = |file: &PathBuf| file.strip_prefix(folder).expect("below the root").to_owned();
        Imports { files: tree.files.iter().map(relative).collect(), of }
    }

    /// Every largest set of files that lead to each other, with two files or more.
    pub(crate) fn circles(&self) -> Vec<Vec<usize>> {
        let reached: Vec<BTreeSet<usize>> = (0..self.files.len()).map(|file| self.reached(file)).collect();
        let mutual = |a: usize| -> Vec<usize> {
            (0..reached.len()).filter(|&b| reached[a].contains(&b) && reached[b].contains(&a)).collect()
        };
        let circles: BTreeSet<Vec<usize>> =
            (0..reached.len()).map(mutual).filter(|c| !c.is_empty()).collect();
        circles.into_iter().collect()
    }

    /// The files that a file's imports lead to, directly or through others.
    fn reached(&self, file: usize) -> BTreeSet<usize> {
        let mut found = BTreeSet::new();
        let mut open = vec![file];
        while let Some(next) = open.pop() {
            open.extend(self.of[next].iter().copied().filter(|&to| found.insert(to)));
        }
        found
    }
}

/// Segments of a path.
type Segments = Vec<String>;

#[derive(Default)]
struct Tree {
    files: Vec<PathBuf>,
    modules: Vec<Module>,
}

/// A module, in a file of its own or in braces.
struct Module {
    file: usize,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    /// Every path in its text.
    paths: Vec<Segments>,
    /// What its `use` declarations name.
    names: BTreeMap<String, Segments>,
    /// Those of them that others can see.
    exports: BTreeSet<String>,
}

impl Tree {
    /// Reads a file as a module; `below` is the folder in which the files of its child modules lie.
    fn read_file(&mut self, file: &Path, below: &Path, parent: Option<usize>) -> usize {
        let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let tokens: TokenStream = text.parse().unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        self.files.push(file.to_owned());
        let module = self.add(self.files.len() - 1, parent);
        self.walk(tokens, module, below);
        module
    }

    fn add(&mut self, file: usize, parent: Option<usize>) -> usize {
        let (children, names) = (BTreeMap::new(), BTreeMap::new());
        self.modules.push(Module { file, parent, children, paths: vec![], names, exports: BTreeSet::new() });
        self.modules.len() - 1
    }

    /// Collects the modules and paths of a piece of a module's text.
    fn walk(&mut self, tokens: TokenStream, module: usize, below: &Path) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let (mut i, mut public) = (0, false);
        while i < tokens.len() {
            let text = word(tokens.get(i));
            let was_public = std::mem::take(&mut public);
            match &tokens[i] {
                TokenTree::Punct(p) if p.as_char() == '#' => {
                    let inner = usize::from(is(tokens.get(i + 1), '!'));
                    let for_tests = tokens.get(i + 1 + inner).is_some_and(is_for_tests);
                    i += 2 + inner;
                    if for_tests && inner == 1 {
                        return;
                    }
                    if for_tests {
                        i += item_length(&tokens[i..]);
                    }
                    public = was_public;
                }
                TokenTree::Group(group) => {
                    self.walk(group.stream(), module, below);
                    i += 1;
                }
                _ if text == "pub" => {
                    i += 1 + usize::from(
                        tokens.get(i + 1).is_some_and(|t| is_group(t, Delimiter::Parenthesis)),
                    );
                    public = true;
                }
                _ if text == "mod" && !word(tokens.get(i + 1)).is_empty() => {
                    let name = word(tokens.get(i + 1));
                    match tokens.get(i + 2) {
                        Some(TokenTree::Group(group)) => {
                            let child = self.add(self.modules[module].file, Some(module));
                            self.modules[module].children.insert(name.clone(), child);
                            self.walk(group.stream(), child, &below.join(name));
                        }
                        _ => self.declared(name, module, below),
                    }
                    i += 3;
                }
                _ if text == "use" => {
                    let end = (i..tokens.len()).find(|&k| is(tokens.get(k), ';')).unwrap_or(tokens.len());
                    self.used(&tokens[i + 1..end], &[], module, was_public);
                    i = end;
                }
                _ if !text.is_empty() && !after_path(&tokens[..i]) => {
                    let mut path = vec![text];
                    i += 1;
                    while is_path(&tokens[i..]) && !word(tokens.get(i + 2)).is_empty() {
                        path.push(word(tokens.get(i + 2)));
                        i += 3;
                    }
                    if path.len() > 1 {
                        self.modules[module].paths.push(path);
                    }
                }
                _ => i += 1,
            }
        }
    }

    /// Reads the file of `mod name;`.
    fn declared(&mut self, name: String, module: usize, below: &Path) {
        let folder = below.join(&name);
        let files = [below.join(format!("{name}.rs")), folder.join("mod.rs")];
        let Some(file) = files.iter().find(|file| file.is_file()) else { return };
        if name != "tests" {
            let child = self.read_file(file, &folder, Some(module));
            self.modules[module].children.insert(name, child);
        }
    }

    /// Collects the paths of a `use`: `a::b`, `a::{b, c::d}`, `a::b as c`, `a::*`.
    fn used(&mut self, tokens: &[TokenTree], before: &[String], module: usize, public: bool) {
        for tree in tokens.split(|t| is(Some(t), ',')) {
            let mut path = before.to_vec();
            let mut name = None;
            for (i, token) in tree.iter().enumerate() {
                match token {
                    TokenTree::Group(group) => {
                        let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                        self.used(&inner, &path, module, public);
                        path.clear();
                    }
                    TokenTree::Ident(ident) if ident == "as" => {
                        name = Some(word(tree.get(i + 1)));
                        break;
                    }
                    TokenTree::Ident(ident) if ident == "self" && !path.is_empty() => {}
                    TokenTree::Ident(ident) => path.push(ident.to_string()),
                    _ => {}
                }
            }
            let Some(last) = path.last() else { continue };
            let name = name.unwrap_or_else(|| last.clone());
            let here = &mut self.modules[module];
            if public {
                here.exports.insert(name.clone());
            }
            here.names.insert(name, path.clone());
            here.paths.push(path);
        }
    }

    /// The deepest module on a path that stands in a module's text, and how many segments lead to it.
    fn resolve(&self, module: usize, path: &[String], depth: usize) -> Option<(usize, usize)> {
        let here = &self.modules[module];
        let mut at = match path.first()?.as_str() {
            "crate" => 0,
            "self" => module,
            "super" => here.parent?,
            name => match here.children.get(name) {
                Some(&child) => child,
                None => self.named(module, name, depth)?,
            },
        };
        for (k, segment) in path.iter().enumerate().skip(1) {
            at = match segment.as_str() {
                "self" => at,
                "super" => self.modules[at].parent?,
                name => match self.modules[at].children.get(name) {
                    Some(&child) => child,
                    None if self.modules[at].exports.contains(name) && !self.is_below(module, at) => {
                        let path = &self.modules[at].names[name];
                        match self.resolve(at, path, depth + 1) {
                            // A module is re-exported: the path goes on in it.
                            Some((to, length)) if length == path.len() => to,
                            Some((to, _)) => return Some((to, k)),
                            None => return Some((at, k)),
                        }
                    }
                    None => return Some((at, k)),
                },
            };
        }
        Some((at, path.len()))
    }

    /// The module that a `use` of this module names, if it is one.
    fn named(&self, module: usize, name: &str, depth: usize) -> Option<usize> {
        let path = self.modules[module].names.get(name).filter(|path| depth < 8 && path[0] != name)?;
        self.resolve(module, path, depth + 1).filter(|(_, length)| *length == path.len()).map(|(to, _)| to)
    }

    fn is_below(&self, module: usize, above: usize) -> bool {
        module == above || self.modules[module].parent.is_some_and(|parent| self.is_below(parent, above))
    }
}

/// The text of a word; empty for anything else.
fn word(token: Option<&TokenTree>) -> String {
    match token {
        Some(TokenTree::Ident(ident)) => ident.to_string(),
        _ => String::new(),
    }
}

fn is(token: Option<&TokenTree>, c: char) -> bool {
    matches!(token, Some(TokenTree::Punct(p)) if p.as_char() == c)
}

fn is_group(token: &TokenTree, delimiter: Delimiter) -> bool {
    matches!(token, TokenTree::Group(group) if group.delimiter() == delimiter)
}

/// Whether tokens begin with `::`.
fn is_path(tokens: &[TokenTree]) -> bool {
    is(tokens.first(), ':') && is(tokens.get(1), ':')
}

/// Whether what follows these tokens goes on with a path, a field or a lifetime.
fn after_path(tokens: &[TokenTree]) -> bool {
    let [.., before, last] = tokens else { return false };
    match last {
        TokenTree::Punct(p) if p.as_char() == '.' => !is(Some(before), '.'),
        TokenTree::Punct(p) if p.as_char() == ':' => is(Some(before), ':'),
        _ => is(Some(last), '\''),
    }
}

/// Whether an attribute's brackets say `cfg(test)` or `cfg(all(test, …))`.
fn is_for_tests(brackets: &TokenTree) -> bool {
    let text: String = brackets.to_string().split_whitespace().collect();
    text.starts_with("[cfg(test)") || text.starts_with("[cfg(all(test,")
}

/// How many tokens an item has: up to its first `;` or braces.
fn item_length(tokens: &[TokenTree]) -> usize {
    let ends = |t: &TokenTree| is(Some(t), ';') || is_group(t, Delimiter::Brace);
    tokens.iter().position(ends).map_or(tokens.len(), |end| end + 1)
}
