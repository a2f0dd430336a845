"""replay"""
def add_arguments(verb): pass
def main(a): return 0
