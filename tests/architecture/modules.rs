//! The modules of a crate, the items that they define, and which file a path leads to.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::paths::{Implementation, Import, behind_visibility, implementation, imports, paths};
use crate::source::{Kind, Token, behind_bracket, behind_item, tokens, without_tests};

#[derive(Debug, Default)]
struct Module {
    parent: Option<usize>,
    /// Index into `Crate::files`.
    file: usize,
    children: BTreeMap<String, usize>,
    items: BTreeSet<String>,
    imports: Vec<Import>,
    tokens: Vec<Token>,
    implementations: Vec<Implementation>,
}

/// A crate without its tests.
#[derive(Debug, Default)]
pub struct Crate {
    pub files: Vec<PathBuf>,
    modules: Vec<Module>,
    /// Macros for the whole crate, by name: the file that defines them.
    macros: BTreeMap<String, usize>,
    /// Inherent methods of (module, type): the file that defines them.
    methods: BTreeMap<(usize, String), BTreeMap<String, usize>>,
}

/// What a path leads to.
#[derive(Clone, Debug, PartialEq)]
enum Target {
    Module(usize),
    /// An item of a module, and the segments behind it (an associated function, a variant).
    Item(usize, String, Vec<String>),
    /// A macro that is visible in the whole crate.
    Macro(usize),
}

/// File `from` needs `name`, which file `to` defines.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Need {
    pub from: usize,
    pub to: usize,
    pub name: String,
    pub line: usize,
}

impl Crate {
    /// Reads a crate from its root file (`lib.rs` or `main.rs`).
    pub fn read(root: &Path) -> Self {
        let mut result = Self::default();
        let folder = root.parent().expect("a file in a folder");
        result.add_file(root, folder, None);
        result.find_methods();
        result
    }

    /// Adds a file's modules; gives the index of its own.
    fn add_file(&mut self, path: &Path, folder: &Path, parent: Option<usize>) -> usize {
        let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
        self.files.push(path.to_owned());
        let file = self.files.len() - 1;
        let tokens = without_tests(tokens(&text));
        self.add_module(tokens, file, folder, parent)
    }

    fn add_module(
        &mut self,
        tokens: Vec<Token>,
        file: usize,
        folder: &Path,
        parent: Option<usize>,
    ) -> usize {
        let index = self.modules.len();
        self.modules.push(Module {
            parent,
            file,
            ..Module::default()
        });
        let mut kept = Vec::new();
        let mut at = 0;
        let mut attributes: Vec<Token> = Vec::new();
        while at < tokens.len() {
            if tokens[at].is("#") {
                let open = at + if tokens[at + 1].is("!") { 2 } else { 1 };
                let end = behind_bracket(&tokens, open);
                attributes.extend_from_slice(&tokens[at..end]);
                at = end;
                continue;
            }
            let end = behind_item(&tokens, at);
            let item = &tokens[at..end];
            if !self.add_child(index, item, &attributes, file, folder) {
                let begin = kept.len();
                kept.extend_from_slice(item);
                self.add_item(index, &kept, begin);
            }
            attributes.clear();
            at = end;
        }
        self.modules[index].imports = imports(&kept);
        self.modules[index].tokens = kept;
        index
    }

    /// A `mod` item: reads it. `false`: another item.
    fn add_child(
        &mut self,
        parent: usize,
        item: &[Token],
        attributes: &[Token],
        file: usize,
        folder: &Path,
    ) -> bool {
        let behind_visibility = behind_visibility(item);
        if !item
            .get(behind_visibility)
            .is_some_and(|token| token.is("mod"))
        {
            return false;
        }
        let name = item[behind_visibility + 1].text.clone();
        let inside = folder.join(&name);
        let child = if item[behind_visibility + 2].is("{") {
            let body = item[behind_visibility + 3..item.len() - 1].to_vec();
            self.add_module(body, file, &inside, Some(parent))
        } else {
            let given = attributes
                .windows(3)
                .find(|three| three[0].is("path") && three[1].is("="))
                .map(|three| three[2].text.trim_matches('"').to_owned());
            let path = match given {
                Some(given) => {
                    let here = self.files[file].parent().expect("a file in a folder");
                    here.join(given)
                }
                None if inside.with_extension("rs").is_file() => inside.with_extension("rs"),
                None => inside.join("mod.rs"),
            };
            self.add_file(&path, &inside, Some(parent))
        };
        self.modules[parent].children.insert(name, child);
        true
    }

    /// Notes what an item defines; it begins at `begin` of the module's tokens.
    fn add_item(&mut self, module: usize, kept: &[Token], begin: usize) {
        let item = &kept[begin..];
        let file = self.modules[module].file;
        let mut words = item.iter().enumerate().skip(behind_visibility(item));
        let keyword = words.find(|(at, token)| {
            let kind = match token.text.as_str() {
                "fn" | "struct" | "enum" | "trait" | "type" | "static" | "union" | "impl"
                | "macro_rules" => true,
                "const" => !item[at + 1].is("fn") && !item[at + 1].is("unsafe"),
                _ => false,
            };
            kind && token.kind == Kind::Word
        });
        let Some((at, keyword)) = keyword else { return };
        if keyword.is("impl") && at <= 1 {
            let found = implementation(item, at, begin);
            self.modules[module].implementations.extend(found);
        } else if keyword.is("macro_rules") {
            let name = item[at + 2].text.clone();
            self.macros.insert(name, file);
        } else if let Some(name) = item.get(at + 1) {
            self.modules[module].items.insert(name.text.clone());
        }
    }

    fn find_methods(&mut self) {
        for module in 0..self.modules.len() {
            for implementation in &self.modules[module].implementations {
                let target = self.resolve(module, &implementation.of_type, 0);
                if let Some(Target::Item(home, name, _)) = target {
                    let file = self.modules[module].file;
                    let methods = self.methods.entry((home, name)).or_default();
                    let found = implementation.methods.iter();
                    methods.extend(found.map(|method| (method.clone(), file)));
                }
            }
        }
    }

    /// Where a path leads that stands in `module`; `None`: out of the crate, or unknown.
    fn resolve(&self, module: usize, path: &[String], depth: usize) -> Option<Target> {
        if depth > 16 {
            return None;
        }
        let (first, rest) = path.split_first()?;
        let inside = &self.modules[module];
        match first.as_str() {
            "crate" => return self.resolve_in(0, rest, depth),
            "self" => return self.resolve_in(module, rest, depth),
            "super" => return self.resolve_in(inside.parent?, rest, depth),
            _ => {}
        }
        self.resolve_in(module, path, depth)
            .filter(|target| *target != Target::Module(module))
    }

    /// As `resolve`, for a path whose first segment is a name in `module` (or `super`).
    fn resolve_in(&self, module: usize, path: &[String], depth: usize) -> Option<Target> {
        let Some((name, rest)) = path.split_first() else {
            return Some(Target::Module(module));
        };
        let inside = &self.modules[module];
        if name == "super" {
            return self.resolve_in(inside.parent?, rest, depth);
        }
        if let Some(child) = inside.children.get(name) {
            return self.resolve_in(*child, rest, depth);
        }
        if inside.items.contains(name) {
            return Some(Target::Item(module, name.clone(), rest.to_vec()));
        }
        for import in &inside.imports {
            let full: Vec<String> = match &import.name {
                Some(known) if known == name => [&import.path, rest].concat(),
                Some(_) => continue,
                None => [&import.path, path].concat(),
            };
            // `use name::...` is the outer crate of that name.
            if full[0] == *name && depth > 0 {
                continue;
            }
            if let Some(target) = self.resolve(module, &full, depth + 1) {
                return Some(target);
            }
        }
        let file = self.macros.get(name)?;
        Some(Target::Macro(*file))
    }

    /// Every need of one file of another. A module that only declares others and re-exports their
    /// items needs none, and who names an item by a re-export needs the file that defines it.
    pub fn needs(&self) -> BTreeSet<Need> {
        let mut needs = BTreeSet::new();
        for (index, module) in self.modules.iter().enumerate() {
            let mut add = |name: &str, to: usize, line: usize| {
                if to != module.file {
                    let name = name.to_owned();
                    needs.insert(Need {
                        from: module.file,
                        to,
                        name,
                        line,
                    });
                }
            };
            for import in module.imports.iter().filter(|import| !import.reexport) {
                match (self.resolve(index, &import.path, 1), &import.name) {
                    // All names of a module: who of them is meant is not asked.
                    (Some(Target::Module(all)), None) if !self.modules[all].items.is_empty() => {
                        add("*", self.modules[all].file, import.line);
                    }
                    (Some(target), _) => self.add_target(&target, import.line, &mut add),
                    _ => {}
                }
            }
            for (path, line) in paths(&module.tokens) {
                if let Some(target) = self.resolve(index, &path, 0) {
                    self.add_target(&target, line, &mut add);
                }
            }
            for implementation in &module.implementations {
                self.add_own_methods(index, implementation, &mut add);
            }
        }
        needs
    }

    fn add_target(&self, target: &Target, line: usize, add: &mut impl FnMut(&str, usize, usize)) {
        match target {
            // A module's name alone; what is taken out of it stands elsewhere.
            Target::Module(_) => {}
            Target::Macro(file) => add("a macro", *file, line),
            Target::Item(home, name, rest) => {
                add(name, self.modules[*home].file, line);
                let methods = self.methods.get(&(*home, name.clone()));
                let method = rest.first().and_then(|method| methods?.get(method));
                if let Some(file) = method {
                    add(&format!("{name}::{}", rest[0]), *file, line);
                }
            }
        }
    }

    /// `self.method()` and `Self::method()`, where the method is defined in another file.
    fn add_own_methods(
        &self,
        module: usize,
        implementation: &Implementation,
        add: &mut impl FnMut(&str, usize, usize),
    ) {
        let target = self.resolve(module, &implementation.of_type, 0);
        let Some(Target::Item(home, name, _)) = target else {
            return;
        };
        add(
            &name,
            self.modules[home].file,
            self.modules[module].tokens[implementation.body.start].line,
        );
        let Some(methods) = self.methods.get(&(home, name.clone())) else {
            return;
        };
        let body = &self.modules[module].tokens[implementation.body.clone()];
        for three in body.windows(3) {
            let own =
                three[0].is("self") && three[1].is(".") || three[0].is("Self") && three[1].is("::");
            if let (true, Some(file)) = (own, methods.get(&three[2].text)) {
                add(&format!("{name}::{}", three[2].text), *file, three[2].line);
            }
        }
    }
}
