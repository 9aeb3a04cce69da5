"""Matchings and connected sets of small graphs, without the slow import of `scipy.sparse.csgraph`.

A graph is given by the columns of each row, ascending.
"""

FAR = 1 << 60
Edges = list[list[int]]


def matching(edges: Edges, n_columns: int) -> list[int]:
    """The column of each row, -1 for an unmatched row (Hopcroft and Karp, SIAM Journal on Computing 2, 1973)."""
    column, row = [-1] * len(edges), [-1] * n_columns
    while True:
        distance, shortest = _distances(edges, column, row)
        if shortest == FAR:
            return column
        for start, mate in enumerate(column):
            if mate < 0:
                _augment(edges, column, row, start, distance, shortest)


def _distances(edges: Edges, column: list[int], row: list[int]) -> tuple[list[int], int]:
    """The distance of each row from an unmatched one on alternating paths, and the length of the shortest augmenting
    path.
    """
    distance = [0 if mate < 0 else FAR for mate in column]
    queue, shortest = [i for i, mate in enumerate(column) if mate < 0], FAR
    for i in queue:
        if distance[i] < shortest:
            for j in edges[i]:
                if row[j] < 0:
                    shortest = min(shortest, distance[i] + 1)
                elif distance[row[j]] == FAR:
                    distance[row[j]] = distance[i] + 1
                    queue.append(row[j])
    return distance, shortest


def _augment(edges: Edges, column: list[int], row: list[int], start: int, distance: list[int], shortest: int) -> None:
    """Match a row along the first remaining shortest path."""
    stack, parent = [start], {start: start}
    while stack:
        i = stack.pop()
        for j in edges[i]:
            if row[j] < 0:
                if distance[i] + 1 == shortest:
                    while True:
                        column[i], row[j], j = j, i, column[i]
                        if i == start:
                            return
                        i = parent[i]
            elif distance[row[j]] == distance[i] + 1:
                stack.append(row[j])
                parent[row[j]] = i
        distance[i] = FAR


def connected(edges: Edges) -> list[int]:
    """The number of the connected set of each node, in order of discovery."""
    both: Edges = [list(others) for others in edges]
    for i, others in enumerate(edges):
        for j in others:
            both[j].append(i)
    label, count = [-1] * len(edges), 0
    for start in range(len(edges)):
        if label[start] < 0:
            label[start], stack = count, [start]
            while stack:
                for j in both[stack.pop()]:
                    if label[j] < 0:
                        label[j] = count
                        stack.append(j)
            count += 1
    return label


def strongly_connected(edges: Edges) -> list[int]:
    """The number of the strongly connected set of each node (Tarjan, SIAM Journal on Computing 1, 1972)."""
    number, low, label = [-1] * len(edges), [0] * len(edges), [-1] * len(edges)
    place, met, count, open_ones = [0] * len(edges), 0, 0, list[int]()
    for start in range(len(edges)):
        path = [start] if number[start] < 0 else []
        while path:
            i = path[-1]
            if number[i] < 0:
                number[i] = low[i] = met
                met += 1
                open_ones.append(i)
            if place[i] < len(edges[i]):
                j = edges[i][place[i]]
                place[i] += 1
                if number[j] < 0:
                    path.append(j)
                elif label[j] < 0:
                    low[i] = min(low[i], number[j])
                continue
            path.pop()
            if path:
                low[path[-1]] = min(low[path[-1]], low[i])
            if low[i] == number[i]:
                while label[i] < 0:
                    label[open_ones.pop()] = count
                count += 1
    return label
