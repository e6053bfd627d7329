"""Records: log files, and the inputs and true values that an estimator reads from them."""
