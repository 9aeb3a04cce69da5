"""The documentation: pages whose python blocks are run, and whose outputs and pictures are what they gave."""
