//! Circles in a graph: sets of files of which each needs, directly or by others, every other.

/// The strongly connected components of more than one node (Tarjan 1972).
pub fn circles(nodes: usize, edges: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let mut search = Search {
        next: vec![Vec::new(); nodes],
        order: vec![None; nodes],
        low: vec![0; nodes],
        stack: Vec::new(),
        count: 0,
        found: Vec::new(),
    };
    for (from, to) in edges {
        search.next[*from].push(*to);
    }
    for node in 0..nodes {
        if search.order[node].is_none() {
            search.visit(node);
        }
    }
    search.found
}

struct Search {
    next: Vec<Vec<usize>>,
    order: Vec<Option<usize>>,
    low: Vec<usize>,
    stack: Vec<usize>,
    count: usize,
    found: Vec<Vec<usize>>,
}

impl Search {
    fn visit(&mut self, node: usize) {
        let order = self.count;
        (self.order[node], self.low[node]) = (Some(order), order);
        self.count += 1;
        self.stack.push(node);
        for next in self.next[node].clone() {
            match self.order[next] {
                None => {
                    self.visit(next);
                    self.low[node] = self.low[node].min(self.low[next]);
                }
                Some(seen) if self.stack.contains(&next) => {
                    self.low[node] = self.low[node].min(seen);
                }
                Some(_) => {}
            }
        }
        if self.low[node] == order {
            let begin = self
                .stack
                .iter()
                .position(|seen| *seen == node)
                .expect("on the stack");
            let mut component = self.stack.split_off(begin);
            component.sort_unstable();
            if component.len() > 1 {
                self.found.push(component);
            }
        }
    }
}
