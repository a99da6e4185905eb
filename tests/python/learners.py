"""scikit-learn's learners on the rows and folds of `thud predict test`: a check that ours are not weaker.

Reads one JSON object from standard input: {"settings": {...}, "cases": [{"learner", "physics", "x", "y", "expected", "unit",
"fold"}]}, a fold for each row. Writes {"forecasts": [[...] or null]} to standard output, in the order of the cases: of each row the
force in N as forecast by what was learned from the other folds.
"""

import json
import sys

import numpy as np
from sklearn.ensemble import GradientBoostingRegressor
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVR
from sklearn.tree import DecisionTreeRegressor


class Standardised:
    """Support vectors on standardised inputs and outputs, of at most so many rows, as ours."""

    def __init__(self, settings):
        self.settings = settings

    def fit(self, x, y):
        step = max(-(-len(x) // self.settings["svr_rows"]), 1)
        x, y = x[::step], y[::step]
        self.scaler = StandardScaler().fit(x)
        self.mean, self.sd = y.mean(), y.std() or 1.0
        self.inner = SVR(C=self.settings["svr_c"], epsilon=self.settings["svr_epsilon"], gamma=1.0 / x.shape[1])
        self.inner.fit(self.scaler.transform(x), (y - self.mean) / self.sd)
        return self

    def predict(self, x):
        return self.mean + self.sd * self.inner.predict(self.scaler.transform(x))


def learner(name, settings):
    if name == "linear":
        # Its least squares drop what is small: a stroke of millimetres beside a stiffness of 100,000 N/m.
        return make_pipeline(StandardScaler(), LinearRegression())
    if name == "svr":
        return Standardised(settings)
    if name == "tree":
        return DecisionTreeRegressor(
            min_samples_leaf=settings["tree_leaf"], min_samples_split=settings["tree_split"], random_state=0
        )
    table = name == "table"
    return GradientBoostingRegressor(
        n_estimators=settings["table_trees" if table else "boosted_trees"],
        max_depth=settings["table_depth" if table else "boosted_depth"],
        learning_rate=settings["table_rate" if table else "boosted_rate"],
        subsample=settings["boosted_subsample"],
        min_samples_leaf=settings["tree_leaf"],
        random_state=0,
    )


def forecast(case, settings):
    x, y, fold = np.array(case["x"]), np.array(case["y"]), np.array(case["fold"])
    expected, unit = np.array(case["expected"]), np.array(case["unit"])
    wanted = (y - expected) / unit if case["physics"] else y
    said = np.empty_like(y)
    for tested in np.unique(fold):
        seen = fold != tested
        said[~seen] = learner(case["learner"], settings).fit(x[seen], wanted[seen]).predict(x[~seen])
    return (expected + unit * said if case["physics"] else said).tolist()


def main():
    asked = json.load(sys.stdin)
    forecasts = [case["learner"] and forecast(case, asked["settings"]) for case in asked["cases"]]
    json.dump({"forecasts": forecasts}, sys.stdout)


main()
