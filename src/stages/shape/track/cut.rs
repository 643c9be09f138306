//! The cheapest division of a graph into two: minimum cut by Dinic's blocking flows (1970).

use std::collections::VecDeque;

/// A graph whose nodes take the label 0 or 1.
pub struct Graph {
    edges: Vec<(u32, i64)>,
    of_node: Vec<Vec<u32>>,
    level: Vec<i32>,
    next: Vec<usize>,
}

impl Graph {
    /// `costs` of the labels 0 and 1 of each node; `ties` cost what they say where their ends differ. Gives the labels
    /// of least total cost (Boykov and Kolmogorov 2004). Costs are told to 1e-4.
    pub fn divide(costs: &[[f64; 2]], ties: &[(u32, u32, f64)]) -> Vec<bool> {
        let n = costs.len();
        let (source, sink) = (n, n + 1);
        let mut graph = Self {
            edges: Vec::new(),
            of_node: vec![Vec::new(); n + 2],
            level: Vec::new(),
            next: Vec::new(),
        };
        let whole = |x: f64| (x * 1e4).round() as i64;
        for (i, [zero, one]) in costs.iter().enumerate() {
            let least = zero.min(*one);
            // Cut from the source: label 1; cut from the sink: label 0.
            graph.join(source, i, whole(one - least), 0);
            graph.join(i, sink, whole(zero - least), 0);
        }
        for (a, b, cost) in ties {
            graph.join(*a as usize, *b as usize, whole(*cost), whole(*cost));
        }
        while graph.rank(source, sink) {
            graph.next = vec![0; n + 2];
            while graph.push(source, sink) > 0 {}
        }
        (0..n).map(|i| graph.level[i] < 0).collect()
    }

    fn join(&mut self, a: usize, b: usize, forth: i64, back: i64) {
        let at = self.edges.len() as u32;
        self.edges.push((b as u32, forth));
        self.edges.push((a as u32, back));
        self.of_node[a].push(at);
        self.of_node[b].push(at + 1);
    }

    fn rank(&mut self, source: usize, sink: usize) -> bool {
        self.level = vec![-1; self.of_node.len()];
        self.level[source] = 0;
        let mut queue = VecDeque::from([source]);
        while let Some(a) = queue.pop_front() {
            for e in &self.of_node[a] {
                let (b, room) = self.edges[*e as usize];
                if room > 0 && self.level[b as usize] < 0 {
                    self.level[b as usize] = self.level[a] + 1;
                    queue.push_back(b as usize);
                }
            }
        }
        self.level[sink] >= 0
    }

    /// One path from source to sink along rising levels; the flow that it takes, 0 where there is none left.
    fn push(&mut self, source: usize, sink: usize) -> i64 {
        let mut path: Vec<u32> = Vec::new();
        let mut at = source;
        while at != sink {
            let found = loop {
                let Some(e) = self.of_node[at].get(self.next[at]).copied() else {
                    break None;
                };
                let (b, room) = self.edges[e as usize];
                if room > 0 && self.level[b as usize] == self.level[at] + 1 {
                    break Some((e, b as usize));
                }
                self.next[at] += 1;
            };
            match (found, path.last().copied()) {
                (Some((e, b)), _) => {
                    path.push(e);
                    at = b;
                }
                (None, Some(e)) => {
                    path.pop();
                    at = self.edges[(e ^ 1) as usize].0 as usize;
                    self.next[at] += 1;
                }
                (None, None) => return 0,
            }
        }
        let flow = path.iter().map(|e| self.edges[*e as usize].1).min().unwrap_or(0);
        for e in path {
            self.edges[e as usize].1 -= flow;
            self.edges[(e ^ 1) as usize].1 += flow;
        }
        flow
    }
}

#[cfg(test)]
mod tests {
    use super::Graph;

    #[test]
    fn a_chain_is_cut_at_its_weakest_tie_and_outliers_are_smoothed() {
        let mut costs = vec![[0.5, 0.5]; 10];
        costs[0] = [0.0, 5.0];
        costs[9] = [5.0, 0.0];
        costs[2] = [0.6, 0.4];
        let ties: Vec<(u32, u32, f64)> = (0..9).map(|i| (i, i + 1, if i == 5 { 0.2 } else { 1.0 })).collect();
        let labels = Graph::divide(&costs, &ties);
        assert_eq!(labels, (0..10).map(|i| i > 5).collect::<Vec<_>>());
    }
}
