"""What all modules share: errors, names of other libraries, values, results, progress, and calls of the system."""
